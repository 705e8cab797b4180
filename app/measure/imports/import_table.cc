#include "app/measure/imports/import_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

namespace plumbline::measure {
namespace {

/// The numbers of a stamp and the characters that follow them.
struct StampParts {
  std::vector<double> numbers;
  std::vector<char> after;
};

std::optional<StampParts> PartsOfStamp(std::string_view text) {
  StampParts parts;
  std::size_t i = 0;
  while (i < text.size() && parts.numbers.size() < 7) {
    double number = 0;
    std::size_t digits = 0;
    for (; i < text.size() && text[i] >= '0' && text[i] <= '9' && digits < 9; ++i, ++digits) {
      number = 10 * number + (text[i] - '0');
    }
    if (digits == 0) return std::nullopt;
    // The seventh number is the fraction of the second.
    if (parts.numbers.size() == 6) {
      for (; digits > 0; --digits) number /= 10;
    }
    parts.numbers.push_back(number);
    parts.after.push_back(i < text.size() ? text[i] : '\0');
    if (i < text.size()) ++i;
    while (i < text.size() && text[i] == ' ') ++i;
    if (i < text.size() && (text[i] == 'A' || text[i] == 'P')) break;
  }
  return parts;
}

}  // namespace

std::optional<double> SecondsOfTimeStamp(std::string_view text, DateOrder slash_order) {
  while (!text.empty() && (text.front() == '\'' || text.front() == ' ')) text.remove_prefix(1);
  const bool afternoon = text.ends_with("PM"), morning = text.ends_with("AM");
  const auto parts = PartsOfStamp(text);
  if (!parts || parts->numbers.size() < 5) return std::nullopt;
  std::vector<double> n = parts->numbers;
  n.resize(7);
  const char date_sign = parts->after[0];
  double year = n[2], month = n[1], day = n[0];
  if (date_sign == '-' && n[0] > 31) year = n[0], day = n[2];
  if (date_sign == '/' && slash_order == DateOrder::kMonthFirst) std::swap(month, day);
  if (date_sign != '.' && date_sign != '-' && date_sign != '/') return std::nullopt;
  if (afternoon && n[3] < 12) n[3] += 12;
  if (morning && n[3] == 12) n[3] = 0;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (year < 1970 || year > 9999 || !date.ok() || n[3] > 23 || n[4] > 59 || n[5] > 60) {
    return std::nullopt;
  }
  const auto days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return 86400 * days + 3600 * n[3] + 60 * n[4] + n[5] + n[6];
}

bool HasSlashDate(std::string_view text) {
  while (!text.empty() && (text.front() == '\'' || text.front() == ' ')) text.remove_prefix(1);
  return text.substr(0, text.find_first_of(" T")).find('/') != std::string_view::npos &&
         (SecondsOfTimeStamp(text, DateOrder::kMonthFirst) ||
          SecondsOfTimeStamp(text, DateOrder::kDayFirst));
}

std::optional<EpochTime> EpochTimeOf(double number) {
  struct Unit {
    double per_second;
    std::string_view name;
  };
  constexpr std::array kUnits = {Unit{1, "seconds"}, Unit{1e3, "milliseconds"},
                                 Unit{1e6, "microseconds"}, Unit{1e9, "nanoseconds"}};
  constexpr double kFrom_s = 1e8, kTo_s = 1e10;
  for (const Unit& unit : kUnits) {
    const double seconds = number / unit.per_second;
    if (seconds >= kFrom_s && seconds < kTo_s) return EpochTime{seconds, unit.name};
  }
  return std::nullopt;
}

namespace {

constexpr double kCoverage = 2;               // k of an expanded uncertainty on one axis
constexpr double kRadiusOfThreeAxes = 2.795;  // 95 % of the chi distribution, 3 degrees of freedom
constexpr double kUnitLengthTolerance = 0.01;
constexpr std::array kMeasuredColumns = {"x_mm", "y_mm", "z_mm", "range_mm", "gauge_mm",
                                         "qw",   "qx",   "qy",   "qz",       "sigma_mm"};

constexpr std::array kReadings = {"x_mm", "range_mm", "gauge_mm", "qw"};

std::string ShownField(const std::string& field) {
  return "\"" + field.substr(0, 40) + "\"";
}

const char* SignWord(char sign) {
  return sign == ',' ? "comma" : "point";
}

bool IsRunOf(const std::string& field, char c) {
  const auto first = field.find_first_not_of("+-");
  return first != std::string::npos &&
         field.find_first_not_of(std::string(1, c) + ".", first) == std::string::npos;
}

bool IsSet(std::string flag) {
  std::transform(flag.begin(), flag.end(), flag.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return !(flag.empty() || flag == "0" || flag == "false" || flag == "no" || flag == "n");
}

bool IsUncertainty(const std::string& target) {
  return target == "sigma_mm" || target.starts_with("u95");
}

/// True for values without which a measurement is still usable.
bool IsAuxiliary(const std::string& target) {
  return target == "t_s" || target == "temp_C" || IsUncertainty(target);
}

/// How the dates with slashes in the time stamps of a file are read.
struct SlashDates {
  int dates = 0, day_first = 0, month_first = 0;  ///< all; with only one valid order

  DateOrder order() const {
    return day_first > month_first ? DateOrder::kDayFirst : DateOrder::kMonthFirst;
  }
};

SlashDates SlashDatesOf(const UnderstoodFile& file) {
  SlashDates found;
  for (std::size_t column = 0; column < file.meanings.size(); ++column) {
    if (file.meanings[column].target != "t_s") continue;
    for (const text::Record& record : file.layout.records) {
      if (column >= record.fields.size() || !HasSlashDate(record.fields[column])) continue;
      ++found.dates;
      const std::string& field = record.fields[column];
      if (!SecondsOfTimeStamp(field, DateOrder::kMonthFirst)) ++found.day_first;
      if (!SecondsOfTimeStamp(field, DateOrder::kDayFirst)) ++found.month_first;
    }
  }
  return found;
}

/// Reads one record; collects the first reason why its measurement cannot be used.
class RowReader {
 public:
  RowReader(const UnderstoodFile& file, const ImportOptions& options)
      : file_(file), options_(options), dates_(SlashDatesOf(file)) {}

  ImportedRow Read(const text::Record& record, std::string& reason);
  std::optional<double> first_stamp_s() const { return first_stamp_s_; }
  /// What was assumed about dates, and which values were left out.
  void AddNotes(std::vector<std::string>& notes) const;

 private:
  void Value(std::size_t column, const std::string& field, ImportedRow& row, std::string& reason);
  void Check(ImportedRow& row, std::string& reason) const;
  void AddSigma(ImportedRow& row) const;

  /// Unreadable values of a column that are left out.
  struct LeftOut {
    int count = 0;
    int first_line = 0;
    std::string first;
  };

  const UnderstoodFile& file_;
  const ImportOptions& options_;
  SlashDates dates_;
  std::optional<double> first_stamp_s_;
  std::string_view epoch_unit_{};  ///< of times since 1970; empty: none were read
  std::map<std::string, LeftOut> left_out_;
};

void Reject(std::string& reason, std::string why) {
  if (reason.empty()) reason = std::move(why);
}

/// A time since 1970 in the stated unit; without one, in that which the size of the number implies.
std::optional<EpochTime> EpochTimeIn(double number, const std::string& unit) {
  if (unit.empty()) return EpochTimeOf(number);
  const auto scale = ScaleOf(ValueKind::kTime, unit);
  const auto in_seconds = scale ? EpochTimeOf(number * scale->factor) : std::nullopt;
  return in_seconds && in_seconds->unit == "seconds" ? in_seconds : std::nullopt;
}

void RowReader::Value(std::size_t column, const std::string& field, ImportedRow& row,
                      std::string& reason) {
  const ColumnMeaning& meaning = file_.meanings[column];
  const auto kind = KindOfTarget(meaning.target);
  if (!kind || field.empty()) return;
  if (*kind == ValueKind::kText) {
    row.texts[meaning.target] = field;
    return;
  }
  if (*kind == ValueKind::kTime) {
    if (const auto stamp_s = SecondsOfTimeStamp(field, dates_.order())) {
      if (!first_stamp_s_) first_stamp_s_ = *stamp_s;
      row.numbers["t_s"] = *stamp_s - *first_stamp_s_;
      return;
    }
  }
  auto number = text::NumberIn(field, file_.layout.decimal);
  if (*kind == ValueKind::kTime && number) {
    if (const auto epoch = EpochTimeIn(*number, meaning.unit)) {
      epoch_unit_ = epoch->unit;
      if (!first_stamp_s_) first_stamp_s_ = epoch->seconds;
      row.numbers["t_s"] = epoch->seconds - *first_stamp_s_;
      return;
    }
  }
  const char other = file_.layout.decimal == ',' ? '.' : ',';
  const bool unclear = number && file_.unclear_decimals.contains(column) &&
                       field.find(other) != std::string::npos && text::NumberIn(field, other);
  if (unclear) number.reset();
  const auto scale = ScaleOf(*kind, meaning.unit);
  const bool impossible = number && *number <= 0 && IsUncertainty(meaning.target);
  if (number && scale && !impossible) {
    row.numbers[meaning.target] = *number * scale->factor + scale->offset;
  } else if (IsAuxiliary(meaning.target)) {
    LeftOut& left_out = left_out_[meaning.target];
    if (++left_out.count == 1) left_out.first_line = row.line, left_out.first = field;
  } else if (IsRunOf(field, 'X') || IsRunOf(field, 'F')) {
    Reject(reason,
           fmt::format("{} is {}: the gauge had no value", meaning.target, ShownField(field)));
  } else if (unclear) {
    Reject(
        reason,
        fmt::format("{} is {}, whose {} may be a decimal sign or separate thousands, since other "
                    "values of the column have a decimal {}",
                    meaning.target, ShownField(field), SignWord(other), SignWord(other)));
  } else if (number && !scale) {
    Reject(reason, fmt::format("{} has no known unit", meaning.target));
  } else {
    Reject(reason, fmt::format("{} is {}, which is not a number with a decimal {}", meaning.target,
                               ShownField(field), SignWord(file_.layout.decimal)));
  }
}

void RowReader::AddNotes(std::vector<std::string>& notes) const {
  if (dates_.dates > 0) {
    notes.push_back(fmt::format(
        "t_s: dates read as {}{}",
        dates_.order() == DateOrder::kDayFirst ? "day/month/year" : "month/day/year",
        dates_.day_first + dates_.month_first > 0
            ? ""
            : ": assumed, since no day is above 12; write them as year-month-day if it is wrong"));
  }
  if (!epoch_unit_.empty())
    notes.push_back(
        fmt::format("t_s: read as {} since 1970; it counts from the first row", epoch_unit_));
  for (const auto& [target, left_out] : left_out_) {
    notes.push_back(fmt::format("{}: {} unusable value{} left out, the first in line {}: {}",
                                target, left_out.count, left_out.count == 1 ? "" : "s",
                                left_out.first_line, ShownField(left_out.first)));
  }
}

void RowReader::Check(ImportedRow& row, std::string& reason) const {
  const auto count = [&](std::initializer_list<const char*> names) {
    return std::ranges::count_if(names,
                                 [&](const char* name) { return row.numbers.contains(name); });
  };
  const auto position = count({"x_mm", "y_mm", "z_mm"}), turn = count({"qw", "qx", "qy", "qz"});
  if (position != 0 && position != 3) Reject(reason, "x, y and z are not all given");
  if (turn != 0 && turn != 4) Reject(reason, "the quaternion is incomplete");
  if (turn == 4) {
    const double norm = std::hypot(std::hypot(row.numbers["qw"], row.numbers["qx"]),
                                   std::hypot(row.numbers["qy"], row.numbers["qz"]));
    if (std::abs(norm - 1) > kUnitLengthTolerance) {
      Reject(reason, fmt::format("the quaternion has the length {:.4g}, not 1", norm));
    }
  }
  if (const auto flag = row.texts.find("delete"); flag != row.texts.end() && IsSet(flag->second)) {
    Reject(reason, "is marked as deleted");
  }
  const bool to_artefact = row.numbers.contains("gauge_mm") || row.numbers.contains("range_mm");
  if (to_artefact && !options_.artefact.empty()) row.texts["artefact"] = options_.artefact;
}

/// Variance of the scatter [mm^2] from sigma_mm or U(95); 0 if neither is given.
double ScatterVariance(const std::map<std::string, double>& n) {
  if (n.contains("sigma_mm")) return std::pow(n.at("sigma_mm"), 2);
  if (n.contains("u95_x_mm") && n.contains("u95_y_mm") && n.contains("u95_z_mm")) {
    double variance = 0;
    for (const char* axis : {"u95_x_mm", "u95_y_mm", "u95_z_mm"}) {
      variance += std::pow(n.at(axis) / kCoverage, 2) / 3;
    }
    return variance;
  }
  return n.contains("u95_mm") ? std::pow(n.at("u95_mm") / kRadiusOfThreeAxes, 2) : 0;
}

/// The length that an instrument's permissible error refers to [m]: the distance of a position, a
/// range, or a gauge's reading; nullopt if the row has none.
std::optional<double> MeasuredLength(const std::map<std::string, double>& n) {
  if (n.contains("x_mm")) {
    return 1e-3 * std::hypot(n.at("x_mm"), std::hypot(n.at("y_mm"), n.at("z_mm")));
  }
  if (n.contains("range_mm")) return 1e-3 * std::abs(n.at("range_mm"));
  if (n.contains("gauge_mm")) return 1e-3 * std::abs(n.at("gauge_mm"));
  return std::nullopt;
}

void RowReader::AddSigma(ImportedRow& row) const {
  double variance = ScatterVariance(row.numbers);
  const bool stated = std::ranges::any_of(
      file_.meanings, [](const ColumnMeaning& meaning) { return IsUncertainty(meaning.target); });
  if (stated && variance == 0) return;  // the scatter of this row is unknown, not zero
  const auto length_m = MeasuredLength(row.numbers);
  if (const auto& mpe = options_.permissible_error; mpe && length_m) {
    variance += std::pow(mpe->constant_mm + mpe->per_metre_mm * *length_m, 2) / 3;
  }
  if (variance > 0) row.numbers["sigma_mm"] = std::sqrt(variance);
}

ImportedRow RowReader::Read(const text::Record& record, std::string& reason) {
  ImportedRow row{record.line, {}, {}, {}};
  const std::size_t columns = file_.meanings.size();
  // A missing last field is an empty one; further fields shift the columns.
  if (record.fields.size() > columns || record.fields.size() + 1 < columns) {
    Reject(reason, fmt::format("has {} fields instead of {}", record.fields.size(), columns));
    if (record.fields.size() > columns) return row;
  }
  for (std::size_t i = 0; i < std::min(columns, record.fields.size()); ++i) {
    Value(i, record.fields[i], row, reason);
  }
  Check(row, reason);
  if (reason.empty()) AddSigma(row);
  if (!reason.empty()) {
    for (const char* name : kMeasuredColumns) row.numbers.erase(name);
    row.texts.erase("artefact");
  }
  return row;
}

}  // namespace

ImportedTable RowsOf(const UnderstoodFile& file, const ImportOptions& options) {
  ImportedTable table;
  RowReader reader(file, options);
  bool from_u95 = false, deviations = false;
  for (const ColumnMeaning& meaning : file.meanings) from_u95 |= meaning.target.starts_with("u95");
  for (const text::Record& record : file.layout.records) {
    std::string reason;
    table.rows.push_back(reader.Read(record, reason));
    table.rows.back().file = file.file;
    if (!reason.empty()) table.rejected.push_back({record.line, reason, file.file});
    deviations |= table.rows.back().numbers.contains("sigma_mm");
  }
  table.first_stamp_s = reader.first_stamp_s();
  reader.AddNotes(table.notes);
  if (from_u95 && deviations) {
    table.notes.emplace_back(
        options.permissible_error
            ? "sigma_mm: U(95) with k = 2 and the permissible error / sqrt(3), root of the squares"
            : "sigma_mm: U(95) with k = 2; this is the scatter of the measurement. Give "
              "--permissible-error-um to include the instrument's accuracy");
  }
  return table;
}

bool ImportedRow::HasMeasurement() const {
  return std::ranges::any_of(kReadings, [&](const char* name) { return numbers.contains(name); }) ||
         texts.contains("artefact");
}

std::string MeasuredCsv(const ImportedTable& table) {
  std::vector<std::string> columns = {"session", "t_s"};
  for (int joint = 1; joint <= 12; ++joint) {
    for (const char* unit : {"deg", "mm"}) columns.push_back(fmt::format("q{}_{}", joint, unit));
  }
  for (const char* name : {"payload_kg", "tool", "payload_item", "temp_C", "camera", "artefact"})
    columns.emplace_back(name);
  for (const char* name : kMeasuredColumns) columns.emplace_back(name);
  const auto absent = [&](const std::string& column) {
    return std::ranges::none_of(table.rows, [&](const ImportedRow& row) {
      return row.numbers.contains(column) || row.texts.contains(column);
    });
  };
  columns.erase(std::remove_if(columns.begin(), columns.end(), absent), columns.end());
  std::string text;
  for (const std::string& column : columns) text += (text.empty() ? "" : ",") + column;
  text += '\n';
  for (const ImportedRow& row : table.rows) {
    std::string line;
    for (const std::string& column : columns) {
      if (&column != &columns.front()) line += ',';
      if (const auto number = row.numbers.find(column); number != row.numbers.end()) {
        line += fmt::format("{:.10g}", 0.0 + number->second);
      } else if (const auto word = row.texts.find(column); word != row.texts.end()) {
        std::string plain = word->second;
        std::replace_if(
            plain.begin(), plain.end(), [](char c) { return c == ',' || c == '"'; }, ' ');
        line += plain;
      }
    }
    text += line + '\n';
  }
  return text;
}

}  // namespace plumbline::measure
