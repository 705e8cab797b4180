#include "app/base/config/toml_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>
#include <vector>

#include "app/base/config/toml_reader.h"

namespace plumbline::config {
namespace {

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

}  // namespace

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

}  // namespace plumbline::config
