#include "app/measure/diagnosis/recorded_signals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

constexpr double kStandstill = 1e-4;  // [rad] or [m]; a smaller movement counts as none

void AddSignal(Dataset& data, std::string column, PerRow<double> values, bool of_joint) {
  RecordedSignal signal{std::move(column), std::move(values), of_joint};
  signal.low = *std::min_element(signal.values.begin(), signal.values.end());
  signal.high = *std::max_element(signal.values.begin(), signal.values.end());
  const double span = signal.high - signal.low;
  if (!(span > 1e-9 * (1 + std::abs(signal.high)))) return;
  std::set<long> distinct;
  for (const double value : signal.values) {
    if (distinct.size() < 50) distinct.insert(std::lround(1e4 * (value - signal.low) / span));
  }
  signal.distinct = static_cast<int>(distinct.size());
  data.signals.push_back(std::move(signal));
}

}  // namespace

void FindSignals(Dataset& data) {
  const auto add = [&data](const std::string& column, bool of_joint = false) {
    PerRow<double> values;
    for (const effects::Conditions& moment : data.conditions) {
      const std::optional<double> value = moment.Signal(column);
      if (!value) return;
      values.push_back(*value);
    }
    AddSignal(data, column, std::move(values), of_joint);
  };
  add("t_s");
  if (!data.table.recorded.time) add("row");
  add("temp_C");
  if (data.loads_recorded()) add("payload_kg");
  for (const std::string& column : data.table.further) add(column);
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const model::JointType type = data.cell.robot.joints[static_cast<std::size_t>(i)].type;
    using Quantity = model::JointQuantity;
    for (const Quantity quantity :
         {Quantity::kPosition, Quantity::kVelocity, Quantity::kAcceleration, Quantity::kTorque}) {
      add(model::JointColumnName(quantity, type, i), true);
    }
  }
}

void FindStillJoints(Dataset& data) {
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const auto moved = [&](const MeasuredRow& row) {
      return std::abs(row.q[i] - data.table.rows.front().q[i]) > kStandstill;
    };
    if (std::any_of(data.table.rows.begin(), data.table.rows.end(), moved)) continue;
    data.still_joints.push_back(i);
    data.notes.push_back(fmt::format(
        "joint q{} never moved: effects that depend on it cannot be identified", i + 1));
  }
}

}  // namespace plumbline::measure
