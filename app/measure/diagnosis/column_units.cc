#include "app/measure/diagnosis/column_units.h"

#include "firmware-like/geometry/angle.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

constexpr std::array<std::pair<double, const char*>, 3> kLengthUnits = {
    {{1000, "metres"}, {25.4, "inches"}, {10, "centimetres"}}};

void ScaleJoint(Dataset& data, RowIndex row, int joint, double factor) {
  data.table.rows[row.offset()].q[joint] *= factor;
  data.conditions[row].q[joint] *= factor;
}

OtherUnit JointIn(int joint, model::JointType type, const std::string& unit, double factor) {
  OtherUnit other{model::JointColumnName(model::JointQuantity::kPosition, type, joint),
                  unit,
                  type == model::JointType::kRevolute ? "degrees" : "millimetres",
                  {},
                  {}};
  other.numbers = {[joint](const MeasuredRow& row) { return row.q[joint]; }};
  other.convert = [joint, factor](Dataset& data, RowIndex row) {
    ScaleJoint(data, row, joint, factor);
  };
  return other;
}

/// All revolute joints together.
OtherUnit AllInRadians(const Dataset& data) {
  OtherUnit other{"the q columns", "radians", "degrees", {}, {}};
  std::vector<int> revolute;
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!IsRevolute(data, joint)) continue;
    revolute.push_back(joint);
    other.numbers.emplace_back([joint](const MeasuredRow& row) { return row.q[joint]; });
  }
  other.convert = [revolute](Dataset& changed, RowIndex row) {
    for (const int joint : revolute) ScaleJoint(changed, row, joint, 1 / kRadPerDeg);
  };
  return other;
}

/// Adds the columns of measured positions (together and one by one) or ranges.
void AddMeasured(const Dataset& data, double factor, const char* unit,
                 std::vector<OtherUnit>& others) {
  if (data.ranges()) {
    others.push_back({"range_mm",
                      unit,
                      "millimetres",
                      {[](const MeasuredRow& row) { return row.range_m.value_or(0); }},
                      [factor](Dataset& changed, RowIndex row) {
                        std::optional<double>& range_m = changed.table.rows[row.offset()].range_m;
                        if (range_m) *range_m *= factor;
                      }});
    return;
  }
  const auto axes = [&](const std::string& columns, int first, int last) {
    OtherUnit other{columns, unit, "millimetres", {}, {}};
    for (int axis = first; axis <= last; ++axis) {
      other.numbers.emplace_back(
          [axis](const MeasuredRow& row) { return row.measured_W.value_or(Vec3::Zero())[axis]; });
    }
    other.convert = [factor, first, last](Dataset& changed, RowIndex row) {
      std::optional<Vec3>& measured_W = changed.table.rows[row.offset()].measured_W;
      if (measured_W) measured_W->segment(first, last - first + 1) *= factor;
    };
    others.push_back(std::move(other));
  };
  axes("x_mm, y_mm, z_mm", 0, 2);
  for (int axis = 0; axis < 3; ++axis) axes(std::string(1, "xyz"[axis]) + "_mm", axis, axis);
}

}  // namespace

bool IsRevolute(const Dataset& data, int joint) {
  return data.cell.robot.joints[joint].type != model::JointType::kPrismatic;
}

bool UsesPayload(const Dataset& data) {
  // With items, the mass of a row is only in part that of its cell in the table.
  return data.table.recorded.payload && data.cell.payload_cog_F && data.cell.payload_items.empty();
}

OtherUnit InRadians(int joint) {
  return JointIn(joint, model::JointType::kRevolute, "radians", 1 / kRadPerDeg);
}

OtherUnit PayloadIn(const std::string& unit, double factor) {
  OtherUnit other{"payload_kg", unit, "kilograms", {}, {}};
  other.numbers = {[](const MeasuredRow& row) { return *row.payload_kg; }};
  other.convert = [factor](Dataset& data, RowIndex row) {
    *data.table.rows[row.offset()].payload_kg *= factor;
    data.conditions[row].payload_kg *= factor;
    data.payloads[row].mass_kg *= factor;
  };
  return other;
}

std::vector<OtherUnit> OtherUnits(const Dataset& data) {
  std::vector<OtherUnit> others = {AllInRadians(data)};
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (IsRevolute(data, joint)) {
      others.push_back(InRadians(joint));
      continue;
    }
    for (const auto& [factor, unit] : kLengthUnits) {
      others.push_back(JointIn(joint, model::JointType::kPrismatic, unit, factor));
    }
  }
  for (const auto& [factor, unit] : kLengthUnits) AddMeasured(data, factor, unit, others);
  if (!UsesPayload(data)) return others;
  for (const auto& [factor, unit] : kPayloadUnits) others.push_back(PayloadIn(unit, factor));
  return others;
}

}  // namespace plumbline::measure
