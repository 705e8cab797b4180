#include "app/base/config/toml_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/base/config/header_lines.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {
namespace {

// One line of a TOML text with a syntax error, and the repair that makes it TOML.

/// Without spaces, tabs and carriage returns at both ends.
std::string_view Trimmed(std::string_view text);

/// Offset of the comment: the first # outside quotes; the size of the line if there is none. If a
/// closing quote is missing, the first # after a space.
std::size_t CommentAt(std::string_view line);

/// The parts of `key = value  # comment`; their sequence is the line.
struct TomlLine {
  std::string head;   ///< up to the value; without "=" only the indentation
  std::string value;  ///< without spaces at its ends
  std::string rest;   ///< spaces and comment

  explicit TomlLine(std::string_view line);
  bool assigns() const { return head.find('=') != std::string::npos; }
  std::string With(std::string_view changed) const { return head + std::string(changed) + rest; }
};

/// A repaired line, and what was wrong.
struct TomlRepair {
  std::string line, what;
};

constexpr std::string_view kSpace = " \t\r";

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

using Repairs = std::vector<TomlRepair>;

void ReplaceAll(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
    text.replace(at, from.size(), to);
    at += to.size();
  }
}

void AddCharacterRepairs(std::string_view line, Repairs& repairs) {
  std::string straight(line);
  for (const char* quote : {"\u201C", "\u201D", "\u201E", "\u00AB", "\u00BB", "\u2018", "\u2019"}) {
    ReplaceAll(straight, quote, "\"");
  }
  if (straight != line) repairs.push_back({straight, "typographic quotes are not allowed"});
  std::string spaced(line);
  ReplaceAll(spaced, "\u00A0", " ");
  if (spaced != line) repairs.push_back({spaced, "a non-breaking space is not allowed"});
  const std::string_view code = Trimmed(line);
  for (const std::string_view sign : {"//", ";", "--", "/*"}) {
    const std::size_t at = line.find(sign);
    if (at == std::string_view::npos || (sign == "--" && !code.starts_with(sign))) continue;
    const std::size_t begin = at + sign.size();
    if (Trimmed(line.substr(begin)).empty()) continue;
    repairs.push_back(
        {fmt::format("{}#{}", line.substr(0, at), line.substr(begin)), "a comment starts with #"});
  }
}

void AddHeaderRepairs(std::string_view line, Repairs& repairs) {
  const TomlLine parts(line);
  if (parts.assigns() || (!parts.value.starts_with('[') && !parts.value.ends_with(']'))) return;
  std::string_view name = parts.value;
  const std::size_t open = name.starts_with("[[") ? 2 : name.starts_with('[') ? 1 : 0;
  const std::size_t closed = name.ends_with("]]") ? 2 : name.ends_with(']') ? 1 : 0;
  if (open == closed || open + closed > name.size()) return;
  name = Trimmed(name.substr(open, name.size() - open - closed));
  const std::size_t brackets = std::max(open, closed);
  repairs.push_back({parts.With(fmt::format("{0:[>{2}}{1}{0:]>{2}}", "", name, brackets)),
                     "the header of a table has as many closing brackets as opening ones"});
}

void AddEqualsRepairs(std::string_view line, Repairs& repairs) {
  const std::string_view code = line.substr(0, CommentAt(line));
  if (const std::size_t colon = code.find(':'); colon < code.find_first_of("=\"'")) {
    repairs.push_back(
        {fmt::format("{} ={}", Trimmed(code.substr(0, colon)), line.substr(colon + 1)),
         "a key is followed by =, not by a colon"});
  }
  const std::string_view words = Trimmed(code);
  if (code.find('=') == std::string_view::npos && !words.starts_with('[')) {
    const std::size_t gap = words.find_first_of(" \t");
    if (gap != std::string_view::npos) {
      repairs.push_back({fmt::format("{} ={}", words.substr(0, gap), words.substr(gap)),
                         "= is missing after the key"});
    }
  }
}

void AddNumberRepairs(const TomlLine& line, Repairs& repairs) {
  const std::string& value = line.value;
  const auto add = [&](std::string changed, const char* what) {
    repairs.push_back({line.With(changed), what});
  };
  if (value.empty()) return;
  const std::size_t comma = value.find(',');
  if (comma != std::string::npos && value.find_first_not_of("+-0123456789,") == std::string::npos) {
    std::string changed = value;
    changed[comma] = '.';
    add(changed, "the decimal separator is a point, not a comma");
  }
  const std::size_t sign = value.front() == '-' || value.front() == '+' ? 1 : 0;
  std::string changed = value;
  if (value.substr(sign).starts_with('.'))
    add(changed.insert(sign, "0"), "a digit is missing in front of the point");
  changed = value;
  if (value.ends_with('.')) add(changed + "0", "a digit is missing after the point");
  if (const std::size_t digit = value.find_first_not_of('0', sign);
      digit != std::string::npos && digit > sign) {
    changed = value;
    add(changed.erase(sign, digit - sign), "a number has no leading zeros");
  }
  const std::size_t end = value.find_first_not_of("+-0123456789.eE_");
  if (IsDigit(value[sign]) && end != std::string::npos && end > 0) {
    const std::string_view unit = Trimmed(std::string_view(value).substr(end));
    const bool letters = std::all_of(unit.begin(), unit.end(), [](char c) {
      return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '%' || c < 0;
    });
    if (letters)
      add(std::string(Trimmed(value.substr(0, end))),
          "a number has no unit behind it: the unit belongs to the key");
  }
}

void AddWordRepairs(const TomlLine& line, Repairs& repairs) {
  const std::string word = Lower(line.value);
  for (const auto& [spelling, written] :
       {std::pair("true", "true"), std::pair("yes", "true"), std::pair("on", "true"),
        std::pair("false", "false"), std::pair("no", "false"), std::pair("off", "false")}) {
    if (word == spelling) {
      repairs.push_back({line.With(written), "yes or no is written true or false, in lower case"});
    }
  }
}

void AddTextRepairs(const TomlLine& line, Repairs& repairs) {
  const std::string& value = line.value;
  if (value.empty()) return;
  const auto add = [&](const std::string& changed, const char* what) {
    repairs.push_back({line.With(changed), what});
  };
  const auto is_quote = [](char c) { return c == '"' || c == '\''; };
  const char first = value.front(), last = value.back();
  if (is_quote(first) && is_quote(last) && first != last && value.size() > 1) {
    add(value.substr(0, value.size() - 1) + first,
        "a text ends with the quote that it starts with");
  }
  if (is_quote(first) && (last != first || value.size() == 1)) {
    add(value + first, "the closing quote is missing");
  }
  if (is_quote(last) && !is_quote(first)) {
    add(std::string(1, last) + value, "the opening quote is missing");
  }
  if (value.find('\\') != std::string::npos && first == '"' && last == '"' && value.size() > 1) {
    add("'" + value.substr(1, value.size() - 2) + "'",
        "\\ in double quotes has a special meaning; use single quotes");
  }
}

void AddListRepairs(const TomlLine& line, Repairs& repairs) {
  const std::string& value = line.value;
  const auto add = [&](const std::string& changed, const char* what) {
    repairs.push_back({line.With(changed), what});
  };
  if (value.empty() || !line.assigns()) return;
  if (value.ends_with(',') || value.ends_with(';')) {
    add(value.substr(0, value.size() - 1), "nothing follows the value, not even a comma or ;");
  }
  if (value.ends_with(']')) {
    add(value.substr(0, value.size() - 1), "the closing bracket has no opening one");
  }
  if (value.starts_with('(') && value.ends_with(')')) {
    add("[" + value.substr(1, value.size() - 2) + "]", "a list is in square brackets");
  }
  if (value.starts_with('[')) add(value + "]", "the closing bracket is missing");
  if (value.starts_with('{')) add(value + " }", "the closing brace is missing");
  if (value.starts_with('[') && value.find_first_of("\"'") == std::string::npos) {
    std::string separated;
    for (std::size_t k = 0; k < value.size(); ++k) {
      const bool gap = kSpace.find(value[k]) != std::string_view::npos;
      const std::size_t next = value.find_first_not_of(kSpace, k);
      const bool between = gap && k > 0 && IsDigit(value[k - 1]) && next != std::string::npos &&
                           (IsDigit(value[next]) || value[next] == '-' || value[next] == '.');
      separated += between ? "," : "";
      separated += value[k] == ';' ? ',' : value[k];
    }
    if (separated != value) add(separated, "commas separate the elements of a list");
  }
  if (value.find_first_of("\"'[]{}=") == std::string::npos) {
    add("\"" + value + "\"", "a text is in quotes");
  }
}

/// All repairs that one of the mistakes would need, the likeliest first.
Repairs RepairsOf(std::string_view line) {
  Repairs repairs;
  AddCharacterRepairs(line, repairs);
  AddHeaderRepairs(line, repairs);
  AddEqualsRepairs(line, repairs);
  const TomlLine parts(line);
  if (parts.assigns()) {
    AddNumberRepairs(parts, repairs);
    AddWordRepairs(parts, repairs);
    AddTextRepairs(parts, repairs);
    AddListRepairs(parts, repairs);
  }
  return repairs;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) + 1 - first);
}

/// Offset of the comment: the first # outside quotes. In a text without a closing quote, the first
/// # after a space.
std::size_t CommentAt(std::string_view line) {
  char quote = 0;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (quote == 0 && line[k] == '#') return k;
    if (line[k] == '"' || line[k] == '\'')
      quote = quote == 0 ? line[k] : quote == line[k] ? 0 : quote;
  }
  if (quote == 0) return line.size();
  return std::min(std::min(line.find(" #"), line.find("\t#")), line.size());
}

TomlLine::TomlLine(std::string_view line) {
  const std::size_t comment = CommentAt(line);
  const std::string_view code = line.substr(0, comment);
  const std::size_t equals = code.find('=');
  std::size_t begin = equals == std::string_view::npos ? 0 : equals + 1;
  begin = std::min(code.find_first_not_of(kSpace, begin), code.size());
  const std::size_t last = code.find_last_not_of(kSpace);
  const std::size_t end = last == std::string_view::npos ? begin : std::max(begin, last + 1);
  head = line.substr(0, begin);
  value = line.substr(begin, end - begin);
  rest = line.substr(end);
}

/// The likeliest repair after which the line is TOML: of one mistake, or of two. Pure.
std::optional<TomlRepair> RepairOf(std::string_view line) {
  constexpr std::size_t kMaxLine = 1000;
  if (line.size() > kMaxLine) return std::nullopt;
  const Repairs repairs = RepairsOf(line);
  for (const TomlRepair& repair : repairs) {
    if (IsToml(repair.line)) return repair;
  }
  for (const TomlRepair& first : repairs) {
    for (TomlRepair& second : RepairsOf(first.line)) {
      if (!IsToml(second.line)) continue;
      return TomlRepair{std::move(second.line), first.what + ", and " + second.what};
    }
  }
  return std::nullopt;
}

std::vector<std::string_view> LinesOf(std::string_view text) {
  std::vector<std::string_view> lines;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
    begin = end + 1;
  }
  return lines;
}

bool MentionsSecret(std::string_view line) {
  std::string lower(line);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower.find("token") != std::string::npos || lower.find("password") != std::string::npos;
}

/// Without control characters, of limited length.
std::string Printable(std::string_view line) {
  constexpr std::size_t kMaxQuoted = 80;
  std::string text(line.substr(0, kMaxQuoted));
  if (line.size() > kMaxQuoted) {
    while (!text.empty() && (text.back() & 0x80) != 0) text.pop_back();
    text += "...";
  }
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return text;
}

/// The key at the start of a line, perhaps in quotes; whatever follows may be a secret.
std::string_view KeyOf(std::string_view line) {
  const std::size_t begin = std::min(line.find_first_not_of("\"'"), line.size());
  return line.substr(begin, line.find_first_of("=: \t\"'", begin) - begin);
}

/// A line as quoted in a message: without comment and secrets, printable, of limited length.
std::string Quoted(std::string_view line) {
  std::string text(Trimmed(line.substr(0, CommentAt(line))));
  if (MentionsSecret(text)) text = std::string(KeyOf(text)) + " = \"...\"";
  return Printable(text);
}

/// The same; a line that is only a comment is quoted with it, unless that may hold a secret.
std::string QuotedRepair(std::string_view line) {
  const std::string_view comment = Trimmed(line);
  if (!comment.starts_with('#')) return Quoted(line);
  return MentionsSecret(comment) ? "# ..." : Printable(comment);
}

/// Column, in characters, at which the repaired line differs.
int ColumnOf(std::string_view line, std::string_view repaired) {
  const auto differs = std::mismatch(line.begin(), line.end(), repaired.begin(), repaired.end());
  return 1 + static_cast<int>(std::count_if(line.begin(), differs.first,
                                            [](char c) { return (c & 0xC0) != 0x80; }));
}

/// The last header at or in front of a line, if it is commented out.
std::string CommentedHeaderHint(const std::vector<HeaderLine>& headers, int line) {
  const HeaderLine* last = nullptr;
  for (const HeaderLine& header : headers) {
    if (header.line < line) last = &header;
  }
  if (last == nullptr || !last->commented) return "";
  return fmt::format("; if this line belongs to {0}, remove the # before {0} in line {1}",
                     last->header, last->line);
}

/// A key or table that is given twice.
std::optional<std::string> ExplainTwice(std::string_view text, int line,
                                        const std::vector<std::string_view>& lines) {
  const std::vector<HeaderLine> headers = HeaderLines(text);
  const auto name_of = [](std::string_view header) {
    const std::size_t first = header.find_first_not_of('['), last = header.find(']');
    return header.substr(first, last - first);
  };
  const HeaderLine* here = nullptr;
  const HeaderLine* table = nullptr;  // that the line is in
  for (const HeaderLine& header : headers) {
    if (header.commented || header.line > line) continue;
    if (header.line == line) here = &header;
    if (header.line < line) table = &header;
  }
  if (here != nullptr) {
    for (const HeaderLine& header : headers) {
      if (header.commented || header.line >= line ||
          name_of(header.header) != name_of(here->header)) {
        continue;
      }
      if (header.header == here->header) {
        return fmt::format(
            "{} is given twice, first in line {}; write all its keys below one of "
            "the headers and remove the other",
            here->header, header.line);
      }
      return fmt::format("{0} is given as {1} in line {2}; write [[{3}]] both times, or keep one",
                         here->header, header.header, header.line, name_of(here->header));
    }
    return std::nullopt;
  }
  const auto key_of = [](std::string_view one) {
    const std::size_t equals = one.substr(0, CommentAt(one)).find('=');
    return equals == std::string_view::npos ? std::string_view() : Trimmed(one.substr(0, equals));
  };
  const std::string_view key = key_of(lines[static_cast<std::size_t>(line) - 1]);
  if (key.empty()) return std::nullopt;
  for (int other = table == nullptr ? 1 : table->line + 1; other < line; ++other) {
    if (key_of(lines[static_cast<std::size_t>(other) - 1]) != key) continue;
    return fmt::format("\"{}\" is given twice, first in line {}; keep one of them{}", Quoted(key),
                       other, CommentedHeaderHint(headers, line));
  }
  return std::nullopt;
}

/// Mistakes of the file as a whole.
std::optional<std::string> ExplainEncoding(std::string_view text, std::string_view line,
                                           std::string_view words) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") ||
      text.substr(0, 4).find('\0') != std::string_view::npos) {
    return "the file is not UTF-8 but UTF-16; save it as UTF-8";
  }
  if (words.find("utf-8") != std::string_view::npos) {
    return "a character is not UTF-8, for instance an umlaut or a degree sign in a comment; save "
           "the file as UTF-8";
  }
  if (line.find('\r') != std::string_view::npos) {
    return "a carriage return is not followed by a line feed; save the file with the line ends of "
           "Linux or Windows";
  }
  return std::nullopt;
}

/// The line in front of `line` where a list, inline table or long text starts that is still open.
std::optional<TomlError> ExplainOpen(const std::vector<std::string_view>& lines, int line,
                                     std::string_view words) {
  const bool text = words.find("string") != std::string_view::npos;
  const bool list = words.find("array") != std::string_view::npos;
  if (!text && !list) return std::nullopt;
  for (int at = line; at >= 1; --at) {
    const std::string_view one = lines[static_cast<std::size_t>(at) - 1];
    const std::size_t begin =
        text ? std::min(one.find("\"\"\""), one.find("'''")) : TomlLine(one).head.size();
    if (text && begin == std::string_view::npos) continue;
    if (!text && (!TomlLine(one).assigns() || !TomlLine(one).value.starts_with('['))) continue;
    const std::string opening(one.substr(begin, text ? 3 : 1));
    return TomlError{at, static_cast<int>(begin) + 1,
                     text ? fmt::format("the text that starts with {0} is not closed; write {0} at "
                                        "its end",
                                        opening)
                          : "the list that starts here is faulty: commas separate its elements, "
                            "and ] ends it"};
  }
  return std::nullopt;
}

}  // namespace

TomlError ExplainTomlError(std::string_view text, int line, int column, std::string_view words) {
  const std::vector<std::string_view> lines = LinesOf(text);
  line = std::clamp(line, 1, static_cast<int>(lines.size()));
  const std::string_view faulty = lines[static_cast<std::size_t>(line) - 1];
  if (const auto what = ExplainEncoding(text, faulty, words)) return {line, column, *what};
  if (words.find("cannot redefine") != std::string_view::npos) {
    if (const auto what = ExplainTwice(text, line, lines)) return {line, 1, *what};
  }
  const auto open = ExplainOpen(lines, line, words);
  for (const int at : {line, open ? open->line : line}) {
    const std::string_view one = lines[static_cast<std::size_t>(at) - 1];
    if (IsToml(one)) continue;
    if (const auto repair = RepairOf(one)) {
      return {at, ColumnOf(one, repair->line),
              fmt::format("{}; write: {}", repair->what, QuotedRepair(repair->line))};
    }
  }
  if (open) return *open;
  const TomlLine parts(faulty);
  if (parts.assigns() && parts.value.empty()) {
    return {line, static_cast<int>(parts.head.size()) + 1,
            "the value is missing; write it after the =, or remove the line"};
  }
  return {line, column, fmt::format("not TOML: {}: {}; correct this line", words, Quoted(faulty))};
}

}  // namespace plumbline::config
