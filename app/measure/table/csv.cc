#include "app/measure/table/csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/base/config/carried_numbers.h"
#include "app/base/config/required_file.h"
#include "app/base/config/toml_reader.h"
#include "app/base/config/wrong_file.h"
#include "app/measure/table/gaps.h"
#include "app/measure/table/table_header.h"
#include "firmware-like/loads/gravity.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

std::string ItemsText(const model::CellModel& cell) {
  return cell.payload_items.empty() ? "no [[payload.item]]"
                                    : "[[payload.item]] " + config::ItemNumbersText(cell);
}

std::optional<std::string> ToolProblem(const model::CellModel& cell, const MeasuredRow& row) {
  if (loads::ToolIndexOf(cell, row.tool_number)) return std::nullopt;
  if (!row.tool_number) {
    return fmt::format(
        "line {}: tool is empty or not a whole number, and the cell declares tools {}: write the "
        "number of the tool that was mounted",
        row.line, config::ToolNumbersText(cell));
  }
  return fmt::format(
      "line {}: tool {} is not declared, the cell declares {}: correct the number, or add a "
      "[[tool]] with number = {}",
      row.line, *row.tool_number, config::ToolNumbersText(cell), *row.tool_number);
}

std::optional<std::string> ItemProblem(const model::CellModel& cell, const MeasuredRow& row) {
  if (!row.payload_item) {
    if (cell.payload_items.empty()) return std::nullopt;
    return fmt::format(
        "line {}: payload_item is empty or not a whole number, and the cell declares {}: write the "
        "number of the item that was carried, 0 for none",
        row.line, ItemsText(cell));
  }
  if (*row.payload_item == 0 || loads::ItemOf(cell, row.payload_item)) return std::nullopt;
  return fmt::format(
      "line {}: payload_item {} is not declared, the cell declares {}: correct the number (0: no "
      "item), or add a [[payload.item]] with number = {}",
      row.line, *row.payload_item, ItemsText(cell), *row.payload_item);
}

}  // namespace

std::optional<std::string> NumberProblem(const model::CellModel& cell, const MeasuredTable& table) {
  if (!table.recorded.tool && cell.tools() > 1) {
    return fmt::format(
        "has no column tool, and the cell declares tools {}: add the column with the number of "
        "the tool that was mounted in each row, or leave only that [[tool]] in the cell",
        config::ToolNumbersText(cell));
  }
  for (const MeasuredRow& row : table.rows) {
    if (table.recorded.tool) {
      if (auto problem = ToolProblem(cell, row)) return problem;
    }
    if (table.recorded.item) {
      if (auto problem = ItemProblem(cell, row)) return problem;
    }
  }
  return std::nullopt;
}

std::vector<std::string> NumberNotes(const model::CellModel& cell, const MeasuredTable& table) {
  std::vector<std::string> notes;
  std::set<int> named;
  for (const MeasuredRow& row : table.rows) {
    if (row.tool_number) named.insert(*row.tool_number);
  }
  if (named.size() > 1 && !cell.tool.number) {
    notes.push_back(fmt::format(
        "the rows name tools {}, but the cell declares one tool without a number, which is used "
        "for all rows: declare each as a [[tool]] with its number",
        fmt::join(named, ", ")));
  }
  if (!table.recorded.item && !cell.payload_items.empty()) {
    notes.emplace_back(
        "payload_item was not recorded: all rows are taken to be without the cell's "
        "[[payload.item]]");
  }
  return notes;
}

namespace {

constexpr double kMinCellSize_m = 0.01;        // measured points of any robot extend farther
constexpr double kQuaternionTolerance = 0.01;  // of its norm; rounding in a file is far smaller

/// Number of decimals in a field; nullopt if it has an exponent.
std::optional<int> DecimalsOf(std::string_view field) {
  if (field.find_first_of("eE") != std::string_view::npos) return std::nullopt;
  const auto point = field.find('.');
  return point == std::string_view::npos ? 0 : static_cast<int>(field.size() - point) - 1;
}

/// Reads the lines below the header; each yields a row or a warning.
class TableReader {
 public:
  TableReader(std::string file, TableHeader header, std::size_t joint_count,
              config::FaultList& faults, TableUse use)
      : joint_count_(static_cast<int>(joint_count)),
        use_(use),
        faults_(faults),
        columns_(std::move(header.columns)) {
    table_.file = std::move(file);
    table_.recorded = header.recorded;
    table_.further = std::move(header.further);
  }

  void ReadRow(std::string_view line, int line_number);
  /// Nullopt if the rows have a fault.
  std::optional<MeasuredTable> Take();

 private:
  void WarnIfInMetres();
  void WarnAboutCameras();
  bool ReportExcessivePayloads();
  bool ReadJoints(MeasuredRow& row) const;
  void Skip(int line, std::string_view column, const std::string& reason);
  void SkipMeasurement(MeasuredRow row, std::string_view column, const std::string& reason);
  void CountDecimals();

  int joint_count_;
  TableUse use_;
  config::FaultList& faults_;
  std::vector<Column> columns_;
  std::vector<std::string_view> fields_;
  bool decimals_counted_ = false;
  std::vector<MeasuredRow> rows_;  ///< measured and unmeasured, in file order
  MeasuredTable table_;
  std::size_t rows_without_camera_ = 0;  ///< skipped, because `camera` names none
  int first_camera_line_ = 0;
  std::string first_camera_;  ///< what the first of them has in its place
};

void TableReader::Skip(int line, std::string_view column, const std::string& reason) {
  table_.unreadable_lines.push_back(line);
  if (reason == kNotACamera) {  // reported once, by WarnAboutCameras()
    ++rows_without_camera_;
    return;
  }
  faults_.Add({config::Fault::Severity::kWarning, table_.file, line, std::string(column),
               reason + "; row not used"});
}

/// Parses only joints and session; false if one of them cannot be read.
bool TableReader::ReadJoints(MeasuredRow& row) const {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Quantity quantity = columns_[i].quantity;
    if (quantity != Quantity::kQ && quantity != Quantity::kSession) continue;
    if (!StoreField(columns_[i], fields_[i], use_, row).empty()) return false;
  }
  return true;
}

/// Skips a row that cannot be used, but counts its joints as a move if they can be read.
void TableReader::SkipMeasurement(MeasuredRow row, std::string_view column,
                                  const std::string& reason) {
  Skip(row.line, column, reason);
  if (ReadJoints(row)) {
    DiscardMeasurement(row);
    rows_.push_back(std::move(row));
  } else {
    table_.breaks.push_back(row.line);
  }
}

void TableReader::ReadRow(std::string_view line, int line_number) {
  if (Trimmed(line).empty()) {
    Skip(line_number, "", "the line is empty");
    table_.breaks.push_back(line_number);
    return;
  }
  SplitFields(line, fields_);
  if (fields_.size() != columns_.size()) {
    Skip(line_number, "",
         fmt::format("has {} fields, but the header has {}", fields_.size(), columns_.size()));
    table_.breaks.push_back(line_number);
    return;
  }
  MeasuredRow row;
  row.line = line_number;
  row.q.setZero(joint_count_);
  row.further.resize(table_.further.size());
  if (table_.recorded.qd) row.qd.setZero(joint_count_);
  if (table_.recorded.qdd) row.qdd.setZero(joint_count_);
  if (table_.recorded.tau) row.tau.setZero(joint_count_);
  if (use_ == TableUse::kMeasured && table_.recorded.position) row.measured_W = Vec3::Zero();
  if (use_ == TableUse::kMeasured && table_.recorded.orientation) {
    row.orientation_W = Eigen::Quaterniond(0, 0, 0, 0);
  }
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const std::string reason = StoreField(columns_[i], fields_[i], use_, row);
    if (reason == kNotACamera && rows_without_camera_ == 0) {
      first_camera_ = Shown(fields_[i]);
      first_camera_line_ = line_number;
    }
    if (!reason.empty()) {
      const double number = NumberOrInfinity(Trimmed(fields_[i]));
      if (columns_[i].quantity == Quantity::kPayload && std::isfinite(number)) {
        table_.excessive_payloads.emplace_back(line_number, number);
      }
      SkipMeasurement(std::move(row), columns_[i].name, reason);
      return;
    }
  }
  if (row.measured_W && row.measured_W->hasNaN()) row.measured_W.reset();
  if (row.orientation_W && row.orientation_W->coeffs().hasNaN()) row.orientation_W.reset();
  if (row.orientation_W) {
    const double length = row.orientation_W->norm();
    if (std::abs(length - 1) > kQuaternionTolerance) {
      SkipMeasurement(std::move(row), "qw",
                      fmt::format("the quaternion has length {:.4g}, not 1", length));
      return;
    }
    row.orientation_W->normalize();
  }
  CountDecimals();
  rows_.push_back(std::move(row));
}

/// Counts the decimals of the angles in the row just read.
void TableReader::CountDecimals() {
  if (!decimals_counted_) table_.q_decimals = 0;
  decimals_counted_ = true;
  for (std::size_t i = 0; i < fields_.size() && table_.q_decimals; ++i) {
    if (columns_[i].quantity != Quantity::kQ || columns_[i].to_si != kRadPerDeg) continue;
    const auto decimals = DecimalsOf(fields_[i]);
    table_.q_decimals =
        decimals ? std::optional(std::max(*decimals, *table_.q_decimals)) : decimals;
  }
}

/// Warns if all points are so close to the origin that they were probably written in metres.
void TableReader::WarnIfInMetres() {
  if (!table_.recorded.position) return;
  double farthest_m = 0;
  for (const MeasuredRow& row : table_.rows) {
    if (row.measured_W) farthest_m = std::max(farthest_m, row.measured_W->norm());
  }
  if (farthest_m == 0 || farthest_m >= kMinCellSize_m) return;
  faults_.Add({config::Fault::Severity::kWarning, table_.file, 1, "x_mm",
               fmt::format("no point is farther than {:.3g} mm from the origin: it looks like "
                           "metres; write mm (a factor of 1000)",
                           farthest_m / kMetrePerMm)});
}

/// Reports payloads that no robot carries once instead of by row. If every payload is as large as
/// that in grams, the column is in grams: a fault.
/// @return  false if there is a fault
bool TableReader::ReportExcessivePayloads() {
  constexpr int kMinRows = 2, kMinShare = 10;  // fewer, or less than a tenth, are typing errors
  constexpr double kLightestInGrams_g = 100;   // payload; in kg, few robots carry as much
  const auto& excessive = table_.excessive_payloads;
  const auto too_large = [](const std::pair<int, double>& one) {
    return one.second > loads::kMaxPayload_kg;
  };
  const auto rows = std::ranges::count_if(excessive, too_large);
  if (rows < kMinRows) return true;
  const auto all = rows + static_cast<std::ptrdiff_t>(table_.rows.size());
  const bool all_large =
      kMinShare * rows >= all && std::ranges::none_of(table_.rows, [](const MeasuredRow& row) {
        return row.payload_kg && *row.payload_kg > 0 && *row.payload_kg < kLightestInGrams_g;
      });
  for (const auto& one : excessive) {
    if (too_large(one)) faults_.RemoveLine(table_.file, one.first);
  }
  const auto& [line, value] = *std::ranges::find_if(excessive, too_large);
  const std::string what = fmt::format(
      "{:g} and other payloads ({} rows in all) are above the {:g} kg of the largest robot", value,
      rows, loads::kMaxPayload_kg);
  if (all_large) {
    faults_.Add({config::Fault::Severity::kFault, table_.file, line, "payload_kg",
                 what + ": the column is in grams; divide it by 1000, or import the table with "
                        "the unit g"});
  } else {
    faults_.Add({config::Fault::Severity::kWarning, table_.file, line, "payload_kg",
                 what + "; rows not used. If they are in grams, divide them by 1000"});
  }
  return !all_large;
}

/// Reports the rows that were skipped because of the column `camera`, with the count: it may hold
/// serial numbers or anything else.
void TableReader::WarnAboutCameras() {
  if (rows_without_camera_ == 0) return;
  faults_.Add({config::Fault::Severity::kWarning, table_.file, first_camera_line_, "camera",
               fmt::format("{} {}; {} of {} rows not used. If the column holds something else, "
                           "such as serial numbers, rename it",
                           first_camera_, kNotACamera, rows_without_camera_, rows_.size())});
}

/// Returns the table. Additional columns that contain anything but numbers and empty cells are
/// dropped with a warning.
std::optional<MeasuredTable> TableReader::Take() {
  const RecordedColumns& recorded = table_.recorded;
  const bool measures = recorded.position || recorded.range || recorded.artefact;
  for (std::size_t i = table_.further.size(); i-- > 0;) {
    const auto bad = std::ranges::find_if(
        rows_, [i](const MeasuredRow& row) { return std::isinf(row.further[i]); });
    if (bad == rows_.end()) continue;
    faults_.Add({config::Fault::Severity::kWarning, table_.file, bad->line,
                 ShownName(table_.further[i]),
                 "is not a column of the format, and not a number here: the column is ignored"});
    DropFurther(i, rows_, table_);
  }
  FindLostLines(rows_, table_);
  if (use_ == TableUse::kMeasured) FillEmptyCells(rows_, table_, faults_);
  table_.rows.reserve(rows_.size());
  for (MeasuredRow& row : rows_) {
    const bool readable = table_.unreadable_lines.empty() ||
                          !std::binary_search(table_.unreadable_lines.begin(),
                                              table_.unreadable_lines.end(), row.line);
    const bool measured = row.measured_W || row.range_m || !row.artefact.empty();
    const bool used = readable && (use_ == TableUse::kPoses || !measures || measured);
    (used ? table_.rows : table_.unmeasured).push_back(std::move(row));
  }
  WarnIfInMetres();
  WarnAboutCameras();
  if (!ReportExcessivePayloads()) return std::nullopt;
  return std::move(table_);
}

}  // namespace

std::optional<MeasuredTable> TableFromCsv(std::string_view text, const std::string& file,
                                          const std::vector<model::Joint>& joints,
                                          config::FaultList& faults, TableUse use) {
  const bool poses = use == TableUse::kPoses;
  const config::Wanted& wanted = poses ? config::kWantedPostures : config::kWantedMeasured;
  if (config::RefuseWrongFile(text, file, wanted, faults)) return std::nullopt;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    text.remove_prefix(kByteOrderMark.size());
  }
  std::optional<TableHeader> header = HeaderFromCsv(TakeUntil('\n', text), file, joints, faults);
  if (!header) return std::nullopt;
  TableReader reader(file, *std::move(header), joints.size(), faults, use);
  for (int line = 2; !text.empty(); ++line) reader.ReadRow(TakeUntil('\n', text), line);
  return reader.Take();
}

std::optional<MeasuredTable> ReadTable(const std::string& path,
                                       const std::vector<model::Joint>& joints,
                                       config::FaultList& faults, TableUse use) {
  const auto text = config::ReadRequiredFile(path, faults, files::kTableSize);
  return text ? TableFromCsv(*text, path, joints, faults, use) : std::nullopt;
}

}  // namespace plumbline::measure
