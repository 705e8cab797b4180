#include "app/measure/table/table_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/base/text/nearest_word.h"
#include "app/measure/table/csv_fields.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
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
