#include "app/measure/table/table_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "app/base/config/limits.h"
#include "app/base/text/text.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

constexpr double kMaxNumber = 1e12;  // no measurement is larger

/// One camera, or two in the order of their names in the format: "rear+side" gives "side+rear".
/// nullopt if the field names no camera, an unknown one, or one of them twice.
std::optional<std::string> CamerasNamed(std::string_view field) {
  constexpr std::array<std::string_view, 4> kNames = {"side", "rear", "front", "top"};
  const auto place = [&](std::string_view name) {
    return std::ranges::find(kNames, name) - kNames.begin();
  };
  const auto count = static_cast<std::ptrdiff_t>(kNames.size());
  const auto plus = field.find('+');
  const std::ptrdiff_t first = place(field.substr(0, plus));
  if (first == count) return std::nullopt;
  if (plus == std::string_view::npos) return std::string(field);
  const std::ptrdiff_t second = place(field.substr(plus + 1));
  if (second == count || second == first) return std::nullopt;
  return std::string(kNames[std::min(first, second)]) + "+" +
         std::string(kNames[std::max(first, second)]);
}

bool IsMeasured(Quantity quantity) {
  switch (quantity) {
    case Quantity::kPosition:
    case Quantity::kRange:
    case Quantity::kOrientation:
    case Quantity::kArtefact:
    case Quantity::kGauge:
    case Quantity::kSigma:
    case Quantity::kCamera:
      return true;
    default:
      return false;
  }
}

/// Marks an empty cell of a measured table for FillEmptyCells(). Returns why the row cannot be used
/// without it, or an empty string.
std::string StoreEmpty(const Column& column, TableUse use, MeasuredRow& row) {
  const char* const needed = "is empty";
  switch (column.quantity) {
    case Quantity::kSession:
    case Quantity::kQ:
      return needed;
    case Quantity::kPosition:
      row.measured_W->setConstant(std::nan(""));
      return {};
    case Quantity::kOrientation:
      row.orientation_W->coeffs().setConstant(std::nan(""));
      return {};
    case Quantity::kRange:
    case Quantity::kGauge:
    case Quantity::kArtefact:
    case Quantity::kSigma:
    case Quantity::kCamera:
      return {};
    default:
      break;
  }
  if (use == TableUse::kPoses) return needed;
  switch (column.quantity) {
    case Quantity::kQd:
      row.qd[column.index] = std::nan("");
      break;
    case Quantity::kQdd:
      row.qdd[column.index] = std::nan("");
      break;
    case Quantity::kTau:
      row.tau[column.index] = std::nan("");
      break;
    default:
      break;
  }
  return {};
}

/// Stores the number of a tool or payload item. Anything else leaves it absent, which is a fault
/// only if the cell declares several tools or items (csv.h).
void StoreToolOrItem(const Column& column, std::string_view field, MeasuredRow& row) {
  constexpr int kLargest = 65535;
  double number = 0;  // spreadsheets write 1 as 1.0
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc() || end != field.data() + field.size()) return;
  if (!(number >= 0 && number <= kLargest) || number != std::floor(number)) return;
  (column.quantity == Quantity::kTool ? row.tool_number : row.payload_item) =
      static_cast<int>(number);
}

/// Stores a name. Returns why it is not one, or an empty string.
std::string StoreName(Quantity quantity, std::string_view field, MeasuredRow& row) {
  if (quantity == Quantity::kSession) row.session = std::string(field);
  if (quantity == Quantity::kArtefact) row.artefact = std::string(field);
  if (quantity != Quantity::kCamera) return {};
  const auto camera = CamerasNamed(field);
  if (!camera) return std::string(kNotACamera);
  row.camera = *camera;
  return {};
}

/// Stores a number that was converted to SI. Returns why it cannot be a value of the quantity, or
/// an empty string.
std::string StoreValue(const Column& column, std::string_view field, double value,
                       MeasuredRow& row) {
  switch (column.quantity) {
    case Quantity::kTime:
      row.t_s = value;
      break;
    case Quantity::kQ:
      row.q[column.index] = value;
      break;
    case Quantity::kQd:
      row.qd[column.index] = value;
      break;
    case Quantity::kQdd:
      row.qdd[column.index] = value;
      break;
    case Quantity::kTau:
      row.tau[column.index] = value;
      break;
    case Quantity::kPayload:
      if (value < 0 || value > loads::kMaxPayload_kg) {
        return fmt::format("{:g} is outside 0..{:g}", value, loads::kMaxPayload_kg);
      }
      row.payload_kg = value;
      break;
    case Quantity::kTemperature:
      row.temp_C = value;
      break;
    case Quantity::kPosition:
      (*row.measured_W)[column.index] += value;  // remains NaN if another cell is empty
      break;
    case Quantity::kRange:
      if (value < 0) return Shown(field) + " is negative";
      row.range_m = value;
      break;
    case Quantity::kOrientation:
      // Eigen stores (x, y, z, w); the columns are (w, x, y, z).
      row.orientation_W->coeffs()[(column.index + 3) % 4] += value;
      break;
    case Quantity::kJointStep:
      if (value < 0) return Shown(field) + " is negative";
      row.q_step_rad = value;
      break;
    case Quantity::kGauge:
      row.gauge_m = value;
      break;
    case Quantity::kSigma:
      if (!(value > 0)) return Shown(field) + " is not positive";
      if (constexpr config::NumberRange kRange = config::kSigmaRange;
          value < kRange.min * kRange.to_si || value > kRange.max * kRange.to_si) {
        return fmt::format("{} is outside {:g}..{:g}", Shown(field), kRange.min, kRange.max);
      }
      row.sigma_m = value;
      break;
    case Quantity::kArtefact:
    case Quantity::kCamera:
    case Quantity::kFurther:
    case Quantity::kSession:
    case Quantity::kTool:
    case Quantity::kPayloadItem:
    case Quantity::kUnused:
      break;
  }
  return {};
}

}  // namespace

double NumberOrInfinity(std::string_view field) {
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  const bool whole = error == std::errc() && end == field.data() + field.size();
  return whole && std::abs(number) <= kMaxNumber ? number : HUGE_VAL;
}

std::string StoreField(const Column& column, std::string_view field, TableUse use,
                       MeasuredRow& row) {
  const Quantity quantity = column.quantity;
  if (quantity == Quantity::kUnused) return {};
  if (use == TableUse::kPoses && IsMeasured(quantity)) return {};
  if (quantity == Quantity::kFurther) {
    row.further[column.index] = field.empty() ? std::nan("") : NumberOrInfinity(field);
    return {};
  }
  if (quantity == Quantity::kTool || quantity == Quantity::kPayloadItem) {
    StoreToolOrItem(column, field, row);
    return {};
  }
  if (field.empty()) return StoreEmpty(column, use, row);
  if (quantity == Quantity::kSession || quantity == Quantity::kArtefact ||
      quantity == Quantity::kCamera) {
    return StoreName(quantity, field, row);
  }
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error == std::errc::result_out_of_range) return Shown(field) + " is out of range";
  if (error != std::errc() || end != field.data() + field.size()) {
    return Shown(field) + " is not a number";
  }
  if (!std::isfinite(number)) return Shown(field) + " is not a finite number";
  if (std::abs(number) > kMaxNumber) return Shown(field) + " is out of range";
  return StoreValue(column, field, number * column.to_si, row);
}

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string Shown(std::string_view field) {
  std::string shown(field.substr(0, 40));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7F) c = '?';
  }
  return fmt::format("\"{}{}\"", shown, field.size() > 40 ? "..." : "");
}

std::string ShownName(std::string_view name) {
  const std::string shown = Shown(name);
  return shown.substr(1, shown.size() - 2);
}

std::string_view TakeUntil(char separator, std::string_view& rest) {
  const auto end = rest.find(separator);
  const std::string_view taken = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return taken;
}

void SplitFields(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  const auto count = std::ranges::count(line, ',') + 1;
  for (std::ptrdiff_t i = 0; i < count; ++i) fields.push_back(Trimmed(TakeUntil(',', line)));
}

namespace {

Quantity QuantityOf(model::JointQuantity quantity) {
  switch (quantity) {
    case model::JointQuantity::kPosition:
      return Quantity::kQ;
    case model::JointQuantity::kVelocity:
      return Quantity::kQd;
    case model::JointQuantity::kAcceleration:
      return Quantity::kQdd;
    case model::JointQuantity::kTorque:
      return Quantity::kTau;
  }
  return Quantity::kUnused;
}

std::vector<Column> KnownColumns(const std::vector<model::Joint>& joints) {
  std::vector<Column> columns = {{"session", Quantity::kSession},
                                 {"t_s", Quantity::kTime},
                                 {"payload_kg", Quantity::kPayload},
                                 {"tool", Quantity::kTool},
                                 {"payload_item", Quantity::kPayloadItem},
                                 {"temp_C", Quantity::kTemperature},
                                 {"q_step_deg", Quantity::kJointStep, 0, kRadPerDeg},
                                 {"x_mm", Quantity::kPosition, 0, kMetrePerMm},
                                 {"y_mm", Quantity::kPosition, 1, kMetrePerMm},
                                 {"z_mm", Quantity::kPosition, 2, kMetrePerMm},
                                 {"range_mm", Quantity::kRange, 0, kMetrePerMm},
                                 {"artefact", Quantity::kArtefact},
                                 {"gauge_mm", Quantity::kGauge, 0, kMetrePerMm},
                                 {"sigma_mm", Quantity::kSigma, 0, kMetrePerMm},
                                 {"camera", Quantity::kCamera},
                                 {"qw", Quantity::kOrientation, 0},
                                 {"qx", Quantity::kOrientation, 1},
                                 {"qy", Quantity::kOrientation, 2},
                                 {"qz", Quantity::kOrientation, 3},
                                 // Instructions in next_poses.csv, not measurements.
                                 {"wait_min", Quantity::kUnused},
                                 {"measure", Quantity::kUnused}};
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const int index = static_cast<int>(i);
    for (const model::JointColumnForm& form : model::kJointColumnForms) {
      if (form.type != joints[i].type) continue;
      columns.push_back({model::JointColumnName(form.quantity, form.type, index),
                         QuantityOf(form.quantity), index, form.to_SI});
    }
  }
  return columns;
}

/// Reads one header line.
class HeaderReader {
 public:
  HeaderReader(const std::string& file, const std::vector<model::Joint>& joints,
               config::FaultList& faults)
      : file_(file),
        joint_count_(static_cast<int>(joints.size())),
        known_(KnownColumns(joints)),
        faults_(faults) {}

  std::optional<TableHeader> Read(std::string_view line);

 private:
  void AddHeaderFault(std::string_view column, std::string what);
  void AddColumn(std::string_view name);
  std::string DidYouMean(std::string_view name) const;
  bool Recorded(Quantity quantity, bool required);

  const std::string& file_;
  int joint_count_;
  std::vector<Column> known_;
  config::FaultList& faults_;
  std::vector<std::string_view> fields_;
  bool faulty_ = false;
  TableHeader header_;
};

void HeaderReader::AddHeaderFault(std::string_view column, std::string what) {
  faulty_ = true;
  faults_.Add({config::Fault::Severity::kFault, file_, 1, ShownName(column), std::move(what)});
}

/// Suggests a missing column that an unknown one may be a misspelling of.
std::string HeaderReader::DidYouMean(std::string_view name) const {
  std::vector<std::string> names;
  for (const Column& column : known_) {
    // Those of an orientation have two characters: similar to everything.
    if (column.quantity != Quantity::kOrientation) names.push_back(column.name);
  }
  const std::string nearest = text::NearestWord(name, names, 0);
  const bool there = std::ranges::find(fields_, nearest) != fields_.end();
  return nearest.empty() || there ? "" : fmt::format("; did you mean {}?", nearest);
}

void HeaderReader::AddColumn(std::string_view name) {
  const auto named = [name](const Column& column) { return column.name == name; };
  if (std::ranges::any_of(header_.columns, named) && !name.empty()) {
    AddHeaderFault(name, "appears twice");
  }
  const auto known = std::ranges::find_if(known_, named);
  if (known != known_.end()) {
    header_.columns.push_back(*known);
    return;
  }
  if (model::ResemblesJointColumn(name)) {
    AddHeaderFault(name,
                   fmt::format("does not fit the cell: it has {} joints, revolute ones in deg "
                               "and Nm, prismatic ones in mm and N",
                               joint_count_));
  } else if (name.empty()) {
    header_.columns.push_back({"", Quantity::kUnused});
    faults_.Add(
        {config::Fault::Severity::kWarning, file_, 1, "", "a column without a name is ignored"});
  } else {
    header_.columns.push_back(
        {std::string(name), Quantity::kFurther, static_cast<int>(header_.further.size())});
    header_.further.emplace_back(name);
    if (name == "tilt_x_deg" || name == "tilt_y_deg") return;  // an effect reads them by name
    faults_.Add(
        {config::Fault::Severity::kWarning, file_, 1, ShownName(name),
         "is not a column of the format: treated as an additional signal" + DidYouMean(name)});
  }
}

/// Whether all columns of a quantity are present. Having only some of them, or none of a required
/// quantity, is a fault.
bool HeaderReader::Recorded(Quantity quantity, bool required) {
  std::vector<std::string> missing;
  bool any = false;
  for (const Column& column : known_) {
    if (column.quantity != quantity) continue;
    const bool there = std::ranges::any_of(
        header_.columns, [&column](const Column& c) { return c.name == column.name; });
    any = any || there;
    if (!there) missing.push_back(column.name);
  }
  if (any || required) {
    for (const std::string& name : missing) AddHeaderFault(name, "missing column");
  }
  return any && missing.empty();
}

std::optional<TableHeader> HeaderReader::Read(std::string_view line) {
  if (Trimmed(line).empty()) {
    AddHeaderFault("", "has no header row");
    return std::nullopt;
  }
  if (line.find(',') == std::string_view::npos && line.find(';') != std::string_view::npos) {
    AddHeaderFault("", "is separated by ';': separate columns by ',' with decimal points");
    return std::nullopt;
  }
  const auto columns = std::ranges::count(line, ',') + 1;
  if (columns > kMaxColumns) {
    AddHeaderFault("", fmt::format("has {} columns, but at most {} are read. Check that this is "
                                   "the right file, and that rows and columns are not exchanged",
                                   columns, kMaxColumns));
    return std::nullopt;
  }
  SplitFields(line, fields_);
  for (const std::string_view name : fields_) AddColumn(name);
  header_.recorded = {.session = Recorded(Quantity::kSession, false),
                      .time = Recorded(Quantity::kTime, false),
                      .qd = Recorded(Quantity::kQd, false),
                      .qdd = Recorded(Quantity::kQdd, false),
                      .tau = Recorded(Quantity::kTau, false),
                      .payload = Recorded(Quantity::kPayload, false),
                      .temperature = Recorded(Quantity::kTemperature, false),
                      .position = Recorded(Quantity::kPosition, false),
                      .range = Recorded(Quantity::kRange, false),
                      .orientation = Recorded(Quantity::kOrientation, false),
                      .q_step = Recorded(Quantity::kJointStep, false),
                      .artefact = Recorded(Quantity::kArtefact, false),
                      .gauge = Recorded(Quantity::kGauge, false),
                      .sigma = Recorded(Quantity::kSigma, false),
                      .camera = Recorded(Quantity::kCamera, false),
                      .tool = Recorded(Quantity::kTool, false),
                      .item = Recorded(Quantity::kPayloadItem, false)};
  Recorded(Quantity::kQ, true);
  if (faulty_) return std::nullopt;
  return std::move(header_);
}

}  // namespace

std::optional<TableHeader> HeaderFromCsv(std::string_view line, const std::string& file,
                                         const std::vector<model::Joint>& joints,
                                         config::FaultList& faults) {
  return HeaderReader(file, joints, faults).Read(line);
}

}  // namespace plumbline::measure
