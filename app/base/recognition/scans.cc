#include "app/base/recognition/scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace plumbline::recognition {
namespace {

constexpr std::size_t kMostDepth = 32;
constexpr std::size_t kLongestName = 120;     // longer ones are cut: paths repeat the names
constexpr std::size_t kMostIgnored = 10'000;  // levels below that; more are no file of anybody's
constexpr std::string_view kSpace = " \t\r\n";

bool IsNameChar(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '.' || c == ':' || c == '/' || byte >= 0x80;
}

std::string Joined(const std::string& path, std::string_view name) {
  std::string joined = path;
  if (!joined.empty() && !name.empty()) joined += '.';
  return joined.append(name.substr(0, kLongestName));
}

std::string_view Unquoted(std::string_view text) {
  text = Trimmed(text);
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
      text.back() == text.front()) {
    return text.substr(1, text.size() - 2);
  }
  return text;
}

/// Position in a text that knows its line.
class Cursor {
 public:
  explicit Cursor(std::string_view text, std::size_t at = 0, int line = 1)
      : text_(text), at_(at), line_(line) {}

  bool done() const { return at_ >= text_.size(); }
  std::size_t at() const { return at_; }
  int line() const { return line_; }
  char peek() const { return text_[at_]; }
  std::string_view rest() const { return text_.substr(at_); }
  void MoveTo(std::size_t to) {
    to = std::min(to, text_.size());
    for (; at_ < to; ++at_) line_ += text_[at_] == '\n' ? 1 : 0;
  }
  /// Moves behind the next `end`. @return false if there is none
  bool MoveBehind(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    MoveTo(found == std::string_view::npos ? text_.size() : found + end.size());
    return found != std::string_view::npos;
  }
  void SkipBlanks() { MoveTo(std::min(text_.find_first_not_of(kSpace, at_), text_.size())); }

 private:
  std::string_view text_;
  std::size_t at_;
  int line_;
};

/// Scan of nested braces and brackets from a position to the end of the value that starts there.
class BracesScan {
 public:
  /// @param path  of the value
  BracesScan(std::string_view text, Cursor from, std::string path, Scan& scan)
      : text_(text), cursor_(from), scan_(scan) {
    paths_.push_back(std::move(path));
  }

  /// @return  the position behind the value
  Cursor Run() {
    do {
      cursor_.SkipBlanks();
      if (cursor_.done()) break;
      Step();
    } while ((!levels_.empty() || !started_) && too_deep_ < kMostIgnored);
    if (!levels_.empty()) {
      scan_.open_at_end = fmt::format("the \"{}\" of line {}", levels_.front().list ? '[' : '{',
                                      levels_.front().line);
      for (; !levels_.empty(); levels_.pop_back()) EnterList();
    }
    return cursor_;
  }

 private:
  struct Level {
    bool list = false;
    std::size_t begin = 0;
    int line = 0;
    bool plain = true;  ///< a list without a map in it
    std::string path;
  };

  bool full() const { return scan_.entries.size() >= Outline::kMostEntries; }
  std::string PathHere() const {
    return levels_.empty() ? paths_.front() : Joined(levels_.back().path, key_);
  }
  void Enter(std::string_view value, int line) {
    if (!full()) scan_.entries.push_back({PathHere(), value, line});
  }
  void EnterList() {
    const Level& level = levels_.back();
    if (!level.list || !level.plain || full()) return;
    if (levels_.size() > 1 && levels_[levels_.size() - 2].list) return;
    scan_.entries.push_back(
        {level.path, text_.substr(level.begin, cursor_.at() - level.begin), level.line});
  }
  void Open(bool list) {
    started_ = true;
    if (!list) {
      for (Level& level : levels_) level.plain = false;
    }
    if (levels_.size() < kMostDepth) {
      levels_.push_back({list, cursor_.at(), cursor_.line(), true, PathHere()});
    } else {
      ++too_deep_;
    }
    key_ = {};
    cursor_.MoveTo(cursor_.at() + 1);
  }
  void Close() {
    cursor_.MoveTo(cursor_.at() + 1);
    if (too_deep_ > 0) {
      --too_deep_;
    } else if (!levels_.empty()) {
      EnterList();
      levels_.pop_back();
    }
    key_ = {};
  }
  std::string_view Word() {
    const std::size_t begin = cursor_.at();
    const char first = cursor_.peek();
    if (first == '"' || first == '\'') {
      std::size_t end = begin + 1;
      while (end < text_.size() && text_[end] != first && text_[end] != '\n') {
        end += text_[end] == '\\' ? 2 : 1;
      }
      end = std::min(end, text_.size());
      cursor_.MoveTo(end + 1);
      return text_.substr(begin + 1, end - begin - 1);
    }
    std::size_t end = std::min(text_.find_first_of(",:={}[]\n\"'", begin), text_.size());
    if (end == begin) end = begin + 1;
    cursor_.MoveTo(end);
    return Trimmed(text_.substr(begin, end - begin));
  }
  void Step() {
    const char c = cursor_.peek();
    if (c == '{' || c == '[') return Open(c == '[');
    if (c == '}' || c == ']') return Close();
    if (c == '#' || cursor_.rest().starts_with("//")) {
      cursor_.MoveBehind("\n");
      return;
    }
    if (c == ',') {
      key_ = {};
      return cursor_.MoveTo(cursor_.at() + 1);
    }
    if (c == ':' || c == '=') return cursor_.MoveTo(cursor_.at() + 1);
    const int line = cursor_.line();
    const std::string_view word = Word();
    if (levels_.empty()) {
      started_ = true;
      Enter(word, line);
      return;
    }
    if (levels_.back().list) return;
    if (key_.empty()) {
      key_ = word;
      return;
    }
    Enter(word, line);
    key_ = {};
  }

  std::string_view text_;
  Cursor cursor_;
  Scan& scan_;
  std::vector<std::string> paths_;
  std::vector<Level> levels_;
  std::size_t too_deep_ = 0;
  std::string_view key_;
  bool started_ = false;
};

/// One line of an indented or headed text, and where it is.
struct TextLine {
  std::string_view all, trimmed;
  std::size_t begin = 0, indent = 0;
  int number = 0;
};

/// Calls `visit(line)` for every line that is neither empty nor a comment. `visit` returns a
/// cursor if it has read on to there.
template <typename Visit>
void EachLine(std::string_view text, Visit visit) {
  std::size_t at = 0;
  for (int number = 1; at < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view all = text.substr(at, end - at);
    const std::string_view trimmed = Trimmed(all);
    if (!trimmed.empty() && trimmed.front() != '#') {
      const auto read = visit(TextLine{all, trimmed, at, all.find_first_not_of(" \t"), number});
      if (read) {
        // The rest of the line on which a value ends is ignored.
        at = std::min(text.find('\n', read->at()), text.size()) + 1;
        number = read->line();
        continue;
      }
    }
    at = end + 1;
  }
}

/// Position of the ':' or '=' that ends a key at the front of a line, or npos.
std::size_t EndOfKey(std::string_view line, char sign) {
  std::size_t at = 0;
  if (!line.empty() && (line.front() == '"' || line.front() == '\'')) {
    at = line.find(line.front(), 1);
    if (at == std::string_view::npos) return at;
    ++at;
  } else {
    while (at < line.size() && line[at] != sign && (IsNameChar(line[at]) || line[at] == ' ')) ++at;
  }
  while (at < line.size() && line[at] == ' ') ++at;
  if (at == 0 || at >= line.size() || line[at] != sign) return std::string_view::npos;
  return at;
}

/// A value without a comment behind it.
std::string_view PlainValue(std::string_view text) {
  text = Trimmed(text);
  if (!text.empty() && (text.front() == '"' || text.front() == '\'')) {
    const std::size_t end = text.find(text.front(), 1);
    return text.substr(1, (end == std::string_view::npos ? text.size() : end) - 1);
  }
  const std::size_t comment = text.find(" #");
  return Trimmed(text.substr(0, comment));
}

/// YAML's end of a key: a ':' before a blank or the end of the line. '::' and times do not count.
std::size_t EndOfYamlKey(std::string_view line) {
  if (!line.empty() && (line.front() == '"' || line.front() == '\'')) return EndOfKey(line, ':');
  for (std::size_t at = line.find(':'); at != std::string_view::npos; at = line.find(':', at + 1)) {
    if (at + 1 == line.size() || line[at + 1] == ' ' || line[at + 1] == '\t') {
      const bool name =
          std::ranges::all_of(line.substr(0, at), [](char c) { return IsNameChar(c) || c == ' '; });
      return name && at > 0 && at <= 80 ? at : std::string_view::npos;
    }
  }
  return std::string_view::npos;
}

}  // namespace

Scan ScanXml(std::string_view text) {
  Scan scan;
  std::vector<std::pair<std::string, std::string>> open;  // path and name
  std::size_t too_deep = 0;
  Cursor cursor(text);
  const auto path = [&open] { return open.empty() ? std::string() : open.back().first; };
  while (scan.entries.size() < Outline::kMostEntries) {
    cursor.MoveTo(std::min(text.find('<', cursor.at()), text.size()));
    if (cursor.done()) break;
    const std::string_view rest = cursor.rest();
    if (rest.starts_with("<!--")) {
      if (!cursor.MoveBehind("-->")) scan.open_at_end = "a comment";
      continue;
    }
    if (rest.starts_with("<![CDATA[")) {
      cursor.MoveBehind("]]>");
      continue;
    }
    if (rest.starts_with("<?") || rest.starts_with("<!")) {
      cursor.MoveBehind(">");
      continue;
    }
    std::size_t at = cursor.at() + 1;
    const bool closing = rest.starts_with("</");
    if (closing) ++at;
    std::size_t end = at;
    while (end < text.size() && text[end] != '/' && IsNameChar(text[end])) ++end;
    const std::string_view name = text.substr(at, end - at);
    if (name.empty()) {
      cursor.MoveTo(cursor.at() + 1);
      continue;
    }
    if (closing) {
      if (too_deep > 0) {
        --too_deep;
      } else {
        const auto found = std::find_if(open.rbegin(), open.rend(),
                                        [&](const auto& one) { return one.second == name; });
        if (found != open.rend()) open.erase(found.base() - 1, open.end());
      }
      cursor.MoveBehind(">");
      continue;
    }
    const bool deep = open.size() >= kMostDepth;
    const std::string own = deep ? std::string() : Joined(path(), name);
    const std::size_t element = scan.entries.size();
    if (!deep) scan.entries.push_back({own, {}, cursor.line()});
    cursor.MoveTo(end);
    bool empty_element = false, closed = false;
    while (!cursor.done() && !closed) {
      cursor.SkipBlanks();
      if (cursor.done()) break;
      const char c = cursor.peek();
      if (c == '<') break;  // the tag is not closed
      if (c == '>') closed = true;
      if (c == '>' || c == '/') {
        empty_element |= c == '/';
        cursor.MoveTo(cursor.at() + 1);
        continue;
      }
      const std::size_t begin = cursor.at();
      std::size_t stop = std::min(text.find_first_of("=<> \t\r\n/", begin), text.size());
      if (stop == begin) stop = begin + 1;
      const std::string_view attribute = text.substr(begin, stop - begin);
      const int line = cursor.line();
      cursor.MoveTo(stop);
      if (cursor.done() || cursor.peek() != '=') continue;
      cursor.MoveTo(cursor.at() + 1);
      if (cursor.done()) break;
      const char quote = cursor.peek();
      if (quote != '"' && quote != '\'') continue;
      const std::size_t close = text.find(quote, cursor.at() + 1);
      const std::size_t behind = std::min(close, text.size());
      const std::string_view value = text.substr(cursor.at() + 1, behind - cursor.at() - 1);
      if (!deep && scan.entries.size() < Outline::kMostEntries) {
        scan.entries.push_back({own + "@" + std::string(attribute), value, line});
      }
      cursor.MoveTo(behind + 1);
    }
    if (!closed && cursor.done()) scan.open_at_end = fmt::format("the tag <{}", name);
    if (empty_element) continue;
    if (deep) {
      if (++too_deep > kMostIgnored) break;
      continue;
    }
    open.emplace_back(own, std::string(name));
    const std::size_t next = std::min(text.find('<', cursor.at()), text.size());
    scan.entries[element].value = Trimmed(text.substr(cursor.at(), next - cursor.at()));
  }
  const bool at_end = cursor.done() || too_deep > kMostIgnored;
  if (at_end && scan.open_at_end.empty() && !open.empty()) {
    scan.open_at_end = "<" + open.back().second + ">";
  }
  return scan;
}

Scan ScanBraces(std::string_view text) {
  Scan scan;
  Cursor cursor(text);
  for (cursor.SkipBlanks(); !cursor.done() && cursor.peek() == '#'; cursor.SkipBlanks()) {
    cursor.MoveBehind("\n");
  }
  scan.end = BracesScan(text, cursor, "", scan).Run().at();
  return scan;
}

Scan ScanYaml(std::string_view text) {
  Scan scan;
  struct Level {
    std::size_t indent;
    std::string path;
  };
  std::vector<Level> levels;
  EachLine(text, [&](const TextLine& line) -> std::optional<Cursor> {
    if (scan.entries.size() >= Outline::kMostEntries) return Cursor(text, text.size());
    std::string_view rest = line.trimmed;
    std::size_t indent = line.indent;
    if (rest.starts_with("%") || rest == "...") return std::nullopt;
    if (rest.starts_with("---") && indent == 0) {
      levels.clear();
      return std::nullopt;
    }
    bool item = false;
    while (rest == "-" || rest.starts_with("- ")) {
      item = true;
      const std::size_t next = rest.find_first_not_of(" \t", 1);
      if (next == std::string_view::npos) return std::nullopt;
      rest.remove_prefix(next);
      indent += next;
    }
    // A list may stand at the indent of its key.
    const auto within = [&](const Level& level) {
      return item ? level.indent < indent : level.indent < line.indent;
    };
    while (!levels.empty() && !within(levels.back())) levels.pop_back();
    const std::string path = levels.empty() ? "" : levels.back().path;
    const std::size_t end = EndOfYamlKey(rest);
    std::string own = path;
    if (end != std::string_view::npos) {
      own = Joined(path, Unquoted(rest.substr(0, end)));
      if (levels.size() < kMostDepth) levels.push_back({indent, own});
      rest = Trimmed(rest.substr(end + 1));
    } else if (!item) {
      return std::nullopt;  // the next line of a long text
    }
    if (rest.starts_with("!!")) {
      const std::size_t blank = std::min(rest.find_first_of(" \t"), rest.size());
      rest = Trimmed(rest.substr(blank));
    }
    if (!rest.empty() && (rest.front() == '[' || rest.front() == '{')) {
      const auto begin = static_cast<std::size_t>(rest.data() - text.data());
      const Cursor behind = BracesScan(text, Cursor(text, begin, line.number), own, scan).Run();
      return scan.open_at_end.empty() ? behind : Cursor(text, text.size());
    }
    const std::string_view value = rest.starts_with("#") ? "" : PlainValue(rest);
    scan.entries.push_back({own, value, line.number});
    return std::nullopt;
  });
  return scan;
}

Scan ScanToml(std::string_view text) {
  Scan scan;
  std::string table;
  EachLine(text, [&](const TextLine& line) -> std::optional<Cursor> {
    if (scan.entries.size() >= Outline::kMostEntries) return Cursor(text, text.size());
    std::string_view rest = line.trimmed;
    if (rest.front() == '[') {
      const std::size_t brackets = rest.starts_with("[[") ? 2 : 1;
      const std::size_t close = rest.find(']');
      if (close == std::string_view::npos) return std::nullopt;
      table = std::string(Trimmed(rest.substr(brackets, close - brackets)));
      scan.entries.push_back({table, rest.substr(0, close + brackets), line.number});
      return std::nullopt;
    }
    const std::size_t end = EndOfKey(rest, '=');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string own = Joined(table, Unquoted(rest.substr(0, end)));
    rest = Trimmed(rest.substr(end + 1));
    if (!rest.empty() && (rest.front() == '[' || rest.front() == '{')) {
      const auto begin = static_cast<std::size_t>(rest.data() - text.data());
      return BracesScan(text, Cursor(text, begin, line.number), own, scan).Run();
    }
    const std::string_view longer = rest.substr(0, 3);
    if (longer == "\"\"\"" || longer == "'''") {
      const auto begin = static_cast<std::size_t>(rest.data() - text.data());
      Cursor cursor(text, begin, line.number);
      scan.entries.push_back({own, longer, line.number});
      cursor.MoveTo(begin + 3);
      cursor.MoveBehind(longer);
      return cursor;
    }
    scan.entries.push_back({own, PlainValue(rest), line.number});
    return std::nullopt;
  });
  return scan;
}

}  // namespace plumbline::recognition
