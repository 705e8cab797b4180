#include "app/base/text/delimited_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

namespace plumbline::text {
namespace {

constexpr std::size_t kSampledLines = 400;  // for the separator
constexpr std::size_t kMaxPreamble = 60;

std::string_view TrimmedField(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  text = text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
  return text;
}

std::string Unquoted(std::string_view field) {
  field = TrimmedField(field);
  if (field.size() < 2 || field.front() != '"' || field.back() != '"') return std::string(field);
  std::string plain;
  field = field.substr(1, field.size() - 2);
  for (std::size_t i = 0; i < field.size(); ++i) {
    plain += field[i];
    if (field[i] == '"' && i + 1 < field.size() && field[i + 1] == '"') ++i;
  }
  return std::string(TrimmedField(plain));
}

std::vector<std::string> SplitAtBlanks(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    line = TrimmedField(line);
    if (line.empty()) return fields;
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    fields.push_back(Unquoted(line.substr(0, end)));
    line.remove_prefix(end);
  }
}

std::vector<std::string> Split(std::string_view line, char separator) {
  if (separator == ' ') return SplitAtBlanks(line);
  std::vector<std::string> fields;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') quoted = !quoted;
    if (i < line.size() && (quoted || line[i] != separator)) continue;
    fields.push_back(Unquoted(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  // A separator at the end of the line begins no further column.
  const std::size_t fewest = separator == '\t' ? 1 : 2;
  if (fields.size() > fewest && fields.back().empty()) fields.pop_back();
  return fields;
}

std::vector<std::string_view> LinesOf(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find('\n');
    // Tabs at either end stay: they may separate empty fields.
    std::string_view line = text.substr(0, end);
    if (TrimmedField(line).empty()) line = {};
    line.remove_prefix(std::min(line.find_first_not_of(" \r"), line.size()));
    lines.push_back(line.substr(0, line.find_last_not_of(" \r") + 1));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return lines;
}

bool IsNumeric(std::string_view field) {
  return NumberIn(field, '.') || NumberIn(field, ',');
}

/// Share of lines with the commonest number of fields (at least two), times the share of numbers
/// among their fields.
double ScoreOf(const std::vector<std::string_view>& lines, char separator) {
  std::map<std::size_t, int> counts;
  std::size_t sampled = 0;
  std::map<std::size_t, std::pair<int, int>> numeric;  // numbers, fields by number of fields
  for (const std::string_view line : lines) {
    if (line.empty()) continue;
    if (++sampled > kSampledLines) break;
    const std::vector<std::string> fields = Split(line, separator);
    ++counts[fields.size()];
    auto& [numbers, all] = numeric[fields.size()];
    for (const std::string& field : fields) numbers += IsNumeric(field) ? 1 : 0;
    all += static_cast<int>(fields.size());
  }
  double best = 0;
  for (const auto& [size, count] : counts) {
    if (size < 2) continue;
    const auto& [numbers, all] = numeric[size];
    best = std::max(best, static_cast<double>(count) * numbers / std::max(1, all));
  }
  return best;
}

char SeparatorOf(const std::vector<std::string_view>& lines) {
  // In the order in which they win a draw; a comma last, since it may be a decimal sign.
  constexpr std::array kSeparators = {';', '\t', ',', ' '};
  char best = ',';
  double best_score = 0;
  for (const char separator : kSeparators) {
    const double score = ScoreOf(lines, separator);
    if (score > best_score * 1.0001) best = separator, best_score = score;
  }
  return best;
}

/// Counts of fields that can only have this decimal sign.
struct DecimalVotes {
  int comma = 0, point = 0, unclear = 0;

  void Add(std::string_view field) {
    const auto comma_at = field.rfind(','), point_at = field.rfind('.');
    const bool has_comma = comma_at != std::string_view::npos;
    const bool has_point = point_at != std::string_view::npos;
    if (!has_comma && !has_point) return;
    if (has_comma && has_point) {
      if (NumberIn(field, comma_at > point_at ? ',' : '.')) ++(comma_at > point_at ? comma : point);
      return;
    }
    const char sign = has_comma ? ',' : '.';
    if (!NumberIn(field, sign)) return;
    const char other = has_comma ? '.' : ',';
    // "1,234" is a number with either sign.
    if (NumberIn(field, other)) {
      unclear += has_comma ? 1 : 0;
      point += has_point ? 1 : 0;
    } else {
      ++(has_comma ? comma : point);
    }
  }
};

/// "%time" is the first column of rostopic echo -p.
bool IsComment(std::string_view line) {
  return line.starts_with("//") || (line.starts_with("%") && !line.starts_with("%time,")) ||
         line.starts_with("# ") || line == "#";
}

int NumbersIn(const Record& record, char decimal) {
  return static_cast<int>(std::ranges::count_if(record.fields, [&](const std::string& field) {
    return NumberIn(field, decimal).has_value();
  }));
}

int TextsIn(const Record& record, char decimal) {
  const auto filled =
      std::ranges::count_if(record.fields, [](const std::string& field) { return !field.empty(); });
  return static_cast<int>(filled) - NumbersIn(record, decimal);
}

bool IsUnit(std::string field) {
  static constexpr std::array kUnits = {"mm", "m",  "um",   "\xC2\xB5m", "in", "inch", "deg", "rad",
                                        "C",  "F",  "K",    "s",         "ms", "kg",   "-",   "",
                                        "°",  "°C", "mbar", "%",         "1",  "cm",   "hPa"};
  field.erase(std::remove_if(field.begin(), field.end(),
                             [](char c) { return c == '[' || c == ']' || c == '(' || c == ')'; }),
              field.end());
  return std::ranges::find(kUnits, field) != kUnits.end();
}

/// Index of the record with the column names; nullopt if the file starts with data.
std::optional<std::size_t> HeaderAt(const std::vector<Record>& records, char decimal) {
  for (std::size_t i = 0; i < records.size() && i < kMaxPreamble; ++i) {
    const int numbers = NumbersIn(records[i], decimal), texts = TextsIn(records[i], decimal);
    if (numbers > 0 && numbers >= texts) return std::nullopt;  // data
    const std::size_t after = i + 1;
    if (texts == 0 || after >= records.size()) continue;
    const bool units_follow = std::ranges::all_of(records[after].fields, IsUnit);
    const std::size_t data = units_follow && after + 1 < records.size() ? after + 1 : after;
    const auto width = static_cast<int>(records[i].fields.size());
    const auto data_width = static_cast<int>(records[data].fields.size());
    if (std::abs(width - data_width) > 1 || NumbersIn(records[data], decimal) == 0) continue;
    if (width >= 2 || data_width == 1) return i;
  }
  return std::nullopt;
}

/// Index of the first record that holds data if there is no header.
std::size_t FirstData(const std::vector<Record>& records, char decimal) {
  for (std::size_t i = 0; i < records.size() && i < kMaxPreamble; ++i) {
    if (NumbersIn(records[i], decimal) > 0) return i;
  }
  return 0;
}

void TakeHeader(std::vector<Record>& records, const LayoutHints& hints, DelimitedText& layout) {
  std::optional<std::size_t> header = HeaderAt(records, layout.decimal);
  if (hints.header_line) {
    header.reset();
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (*hints.header_line > 0 && records[i].line == *hints.header_line) header = i;
    }
  }
  std::size_t data = header ? *header + 1 : FirstData(records, layout.decimal);
  if (hints.header_line == 0) data = 0;
  if (header) {
    layout.header_line = records[*header].line;
    layout.names = records[*header].fields;
    // A name is one line: TextOfMapping() writes it, and TOML's reader refuses line breaks.
    for (std::string& name : layout.names) std::ranges::replace(name, '\r', ' ');
    if (data < records.size() && TextsIn(records[data], layout.decimal) > 0 &&
        std::ranges::all_of(records[data].fields, IsUnit)) {
      layout.units = records[data++].fields;
    }
  }
  records.erase(records.begin(), records.begin() + static_cast<std::ptrdiff_t>(data));
  std::size_t width = layout.names.size();
  for (const Record& record : records) {
    if (!header) width = std::max(width, record.fields.size());
  }
  layout.names.resize(width);
  layout.units.resize(width);
  layout.records = std::move(records);
}

}  // namespace

std::optional<double> NumberIn(std::string_view field, char decimal) {
  field = TrimmedField(field);
  if (field.starts_with('\'')) field.remove_prefix(1);
  if (field.size() > 1 && field[0] == '+' && field[1] != '-') field.remove_prefix(1);
  if (field.empty() || field.size() > 40) return std::nullopt;
  const char other = decimal == ',' ? '.' : ',';
  std::string plain;
  std::size_t group = 0;  // digits since the last thousands separator
  bool grouped = false, fraction = false;
  for (const char c : field) {
    if (c == other) {
      const std::size_t leading = plain.size() - (plain.starts_with('-') ? 1 : 0);
      if (fraction || (grouped ? group != 3 : leading == 0 || leading > 3)) return std::nullopt;
      // No group of thousands starts with a zero: "0,512" is not 512.
      if (!grouped && plain[plain.size() - leading] == '0') return std::nullopt;
      grouped = true, group = 0;
      continue;
    }
    if (c == decimal || c == 'e' || c == 'E') {
      if (grouped && !fraction && group != 3) return std::nullopt;
      fraction = true;
    }
    ++group;
    plain += c == decimal ? '.' : c;
  }
  if (grouped && !fraction && group != 3) return std::nullopt;
  double number = 0;
  const auto [end, error] = std::from_chars(plain.data(), plain.data() + plain.size(), number);
  if (error != std::errc() || end != plain.data() + plain.size()) return std::nullopt;
  if (!std::isfinite(number)) return std::nullopt;
  return number;
}

DelimitedText LayoutOf(std::string_view text, const LayoutHints& hints) {
  const std::vector<std::string_view> lines = LinesOf(text);
  DelimitedText layout;
  std::vector<std::string_view> plain;
  for (const std::string_view line : lines) {
    if (!IsComment(line)) plain.push_back(line);
  }
  layout.separator = hints.separator.value_or(SeparatorOf(plain));
  std::vector<Record> records;
  DecimalVotes votes;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool named = hints.header_line && static_cast<int>(i) + 1 == *hints.header_line;
    if (lines[i].empty()) continue;
    if (IsComment(lines[i]) && !named) {
      if (layout.preamble.size() < kMaxPreamble) layout.preamble.emplace_back(lines[i]);
      continue;
    }
    Record record{static_cast<int>(i) + 1, Split(lines[i], layout.separator)};
    for (const std::string& field : record.fields) votes.Add(field);
    records.push_back(std::move(record));
  }
  layout.decimal = votes.comma > votes.point ? ',' : '.';
  if (votes.comma == 0 && votes.point == 0 && votes.unclear > 0) {
    layout.decimal = ',';
    layout.decimal_assumed = true;
  }
  if (hints.decimal) layout.decimal = *hints.decimal, layout.decimal_assumed = false;
  const std::vector<Record> all = records;
  TakeHeader(records, hints, layout);
  for (const Record& record : all) {
    const bool before = layout.header_line > 0
                            ? record.line < layout.header_line
                            : !layout.records.empty() && record.line < layout.records.front().line;
    if (before) layout.preamble.emplace_back(lines[static_cast<std::size_t>(record.line) - 1]);
  }
  return layout;
}

}  // namespace plumbline::text
