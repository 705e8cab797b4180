#include "app/base/config/toml_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <vector>

#include "app/base/config/header_lines.h"
#include "app/base/config/toml_line.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {
namespace {

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
