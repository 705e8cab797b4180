#include "app/base/text/text.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <ctime>
#include <numeric>

namespace plumbline::text {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Read position in a text, with its line number.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {
    if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
  }

  bool AtEnd() const { return at_ == text_.size(); }
  char Here() const { return AtEnd() ? '\0' : text_[at_]; }
  bool Starts(std::string_view with) const { return text_.substr(at_).starts_with(with); }
  int line() const { return line_; }

  void Advance() {
    if (AtEnd()) return;
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }
  void Advance(std::size_t count) {
    for (; count > 0; --count) Advance();
  }
  void SkipLine() {
    while (!AtEnd() && Here() != '\n') Advance();
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// Skips a TOML string of any of the four kinds, from its first delimiter.
void SkipTomlString(Cursor& cursor) {
  const char quote = cursor.Here();
  const std::string_view fence = quote == '"' ? R"(""")" : "'''";
  const bool multi_line = cursor.Starts(fence);
  cursor.Advance(multi_line ? fence.size() : 1);
  while (!cursor.AtEnd()) {
    if (quote == '"' && cursor.Here() == '\\') {
      cursor.Advance(2);
    } else if (multi_line && cursor.Starts(fence)) {
      cursor.Advance(fence.size());
      // Up to two quotes before the closing fence belong to the text.
      for (int k = 0; k < 2 && cursor.Here() == quote; ++k) cursor.Advance();
      return;
    } else if (!multi_line && (cursor.Here() == quote || cursor.Here() == '\n')) {
      if (cursor.Here() == quote) cursor.Advance();
      return;
    } else {
      cursor.Advance();
    }
  }
}

/// Stack of the open brackets and the number of levels that each contributes.
class Brackets {
 public:
  int depth() const { return depth_; }
  bool empty() const { return count_ == 0; }
  bool InTable() const { return count_ > 0 && open_[count_ - 1].table; }

  /// Adds one level for a bracket. The caller has checked the depth against the limit.
  void Open(bool table) {
    open_[count_++] = {table, 1};
    ++depth_;
  }
  /// Replaces the levels of the innermost table's previous key by those of the current one.
  void SetKeyParts(int parts) {
    Level& level = open_[count_ - 1];
    depth_ += 1 + parts - level.levels;
    level.levels = 1 + parts;
  }
  void Close() {
    if (count_ > 0) depth_ -= open_[--count_].levels;
  }

 private:
  struct Level {
    bool table = false;
    int levels = 0;
  };
  std::array<Level, kMaxNestingDepth + 1> open_{};
  std::size_t count_ = 0;
  int depth_ = 0;
};

/// Minimal TOML scanner: keys, strings, comments and brackets.
class TomlNesting {
 public:
  explicit TomlNesting(std::string_view text) : cursor_(text) {}

  std::optional<int> LineTooDeep() {
    while (!cursor_.AtEnd() && !too_deep_) ReadStatement();
    return too_deep_;
  }

 private:
  void CheckDepth(int depth) {
    if (depth > kMaxNestingDepth) too_deep_ = cursor_.line();
  }

  /// Reads a key up to its delimiter. @return the number of its dotted parts
  int KeyParts() {
    int parts = 0;
    bool part = false;
    while (!cursor_.AtEnd() && parts <= kMaxNestingDepth) {
      const char here = cursor_.Here();
      if (std::string_view("=[]{},#\n").find(here) != std::string_view::npos) break;
      if (here == '"' || here == '\'') {
        SkipTomlString(cursor_);
        part = true;
        continue;
      }
      part = part || (here != ' ' && here != '\t');
      if (here == '.') ++parts;
      cursor_.Advance();
    }
    return parts + (part ? 1 : 0);
  }

  void ReadStatement() {
    const char here = cursor_.Here();
    if (here == ' ' || here == '\t' || here == '\r' || here == '\n') return cursor_.Advance();
    if (here == '#') return cursor_.SkipLine();
    if (here == '[') {
      cursor_.Advance(cursor_.Starts("[[") ? 2 : 1);
      header_parts_ = KeyParts();
      CheckDepth(header_parts_);
      return cursor_.SkipLine();
    }
    const int parts = KeyParts();
    CheckDepth(header_parts_ + parts);
    if (cursor_.Here() != '=') return cursor_.SkipLine();
    ReadValue(header_parts_ + parts);
  }

  /// Reads from the equals sign to the end of the value's last line.
  void ReadValue(int outside) {
    Brackets brackets;
    while (!cursor_.AtEnd() && !too_deep_) {
      const char here = cursor_.Here();
      if (here == '"' || here == '\'') {
        SkipTomlString(cursor_);
        continue;
      }
      if (here == '#') {
        cursor_.SkipLine();
        continue;
      }
      if (here == '\n' && brackets.empty()) return;
      cursor_.Advance();
      if (here == '[' || here == '{') {
        CheckDepth(outside + brackets.depth() + 1);
        if (too_deep_) return;
        brackets.Open(here == '{');
      } else if (here == ']' || here == '}') {
        brackets.Close();
        continue;
      }
      if (here == '{' || (here == ',' && brackets.InTable())) {
        brackets.SetKeyParts(KeyParts());
        CheckDepth(outside + brackets.depth());
      }
    }
  }

  Cursor cursor_;
  int header_parts_ = 0;
  std::optional<int> too_deep_;
};

}  // namespace

std::optional<int> LineNestedTooDeepInToml(std::string_view text) {
  return TomlNesting(text).LineTooDeep();
}

std::optional<int> LineNestedTooDeepInJson(std::string_view text) {
  Cursor cursor(text);
  int depth = 0;
  bool in_string = false;
  for (; !cursor.AtEnd(); cursor.Advance()) {
    const char here = cursor.Here();
    if (in_string && here == '\\') {
      cursor.Advance();
    } else if (here == '"') {
      in_string = !in_string;
    } else if (!in_string && (here == '[' || here == '{')) {
      if (++depth > kMaxNestingDepth) return cursor.line();
    } else if (!in_string && (here == ']' || here == '}')) {
      --depth;
    }
  }
  return std::nullopt;
}

std::string NestedTooDeepText() {
  return fmt::format(
      "nested more than {} levels deep (brackets and dotted keys together); shorten the key or "
      "remove surplus brackets",
      kMaxNestingDepth);
}

std::string TextFromUtc(double utc_s) {
  const auto seconds = static_cast<std::time_t>(std::floor(utc_s));
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string TextOfUtcNow() {
  return TextFromUtc(static_cast<double>(std::time(nullptr)));
}

std::optional<double> UtcFromText(const std::string& text) {
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (end == nullptr || *end != '\0') return std::nullopt;
  const auto utc_s = static_cast<double>(timegm(&parts));
  if (TextFromUtc(utc_s) != text) return std::nullopt;  // a date that does not exist
  return utc_s;
}

namespace {

/// Length of the UTF-8 character at the start of the text, and its code; length 0 if there is none.
struct Character {
  std::size_t length = 0;
  std::uint32_t code = 0;
};

Character FirstCharacter(std::string_view text) {
  const auto byte = [&text](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(0);
  if (first < 0x80) return {1, first};
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return {};
  std::uint32_t code = first & (0x7FU >> length);
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0U) != 0x80) return {};
    code = code << 6U | (byte(k) & 0x3FU);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  return code < kSmallest[length] || code > 0x10FFFF || surrogate ? Character{}
                                                                  : Character{length, code};
}

bool IsExecuted(std::uint32_t code) {
  if (code < 0x20) return code != '\t' && code != '\n';
  return (code >= 0x7F && code < 0xA0) || code == 0x061C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string Visible(std::string_view text) {
  std::string visible;
  visible.reserve(text.size());
  while (!text.empty()) {
    const Character next = FirstCharacter(text);
    const std::size_t length = next.length == 0 ? 1 : next.length;
    if (next.length == 0) {
      visible += fmt::format("\\x{:02x}", static_cast<unsigned char>(text.front()));
    } else if (IsExecuted(next.code)) {
      visible += fmt::format("\\u{:04x}", next.code);
    } else {
      visible += text.substr(0, length);
    }
    text.remove_prefix(length);
  }
  return visible;
}

namespace {

constexpr std::size_t kMaxWordLength = 64;

/// Levenshtein distance: single-character edits from a to b.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// The word without its unit suffix: "payload" for "payload_kg".
std::string_view WithoutUnit(std::string_view word) {
  const auto unit = word.rfind('_');
  return unit == std::string_view::npos ? word : word.substr(0, unit);
}

}  // namespace

std::string NearestWord(std::string_view word, const std::vector<std::string>& known,
                        double share) {
  std::string nearest;
  std::size_t best =
      std::max<std::size_t>(2, static_cast<std::size_t>(share * static_cast<double>(word.size()))) +
      1;
  if (word.size() > kMaxWordLength) return nearest;
  for (const std::string& candidate : known) {
    const bool is_prefix = word.size() >= 3 && candidate.compare(0, word.size(), word) == 0;
    const bool other_unit = WithoutUnit(candidate) == WithoutUnit(word);
    const std::size_t distance = is_prefix || other_unit ? 1 : EditDistance(word, candidate);
    if (distance < best && distance < candidate.size()) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace plumbline::text
