#include "app/measure/diagnosis/validation/input_ranges.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "app/measure/diagnosis/validation/farthest_poses.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {
namespace {

constexpr double kLeastTemperatureRange_K = 5;

using Measured = std::optional<model::MeasuredRange>;

/// The values as intervals that are more than a share of their range apart.
Measured RangeOf(std::vector<double> values, double gap) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const double apart = std::max(gap * (values.back() - values.front()), 1e-9);
  model::MeasuredRange measured;
  for (const double value : values) {
    if (measured.intervals.empty() || value - measured.intervals.back().high > apart)
      measured.intervals.push_back({value, value});
    measured.intervals.back().high = value;
  }
  return measured;
}

double SquaredBeyond(const Measured& measured, const std::optional<double>& value,
                     double per_unit) {
  if (!measured || !value) return 0;
  return std::pow(per_unit * measured->Nearest(*value).DistanceOf(*value), 2);
}

/// The range of the values without the two at each end, 0 included.
model::Interval TorqueRange(std::vector<double> values) {
  constexpr std::size_t kLeftOut = 2;
  std::ranges::sort(values);
  if (values.size() <= 2 * kLeftOut) return {};
  return {std::min(0.0, values[kLeftOut]), std::max(0.0, values[values.size() - 1 - kLeftOut])};
}

/// Values of some rows.
template <typename ValueOf>
std::vector<double> ColumnOf(const PerRow<RowInputs>& inputs, const FitRows& rows,
                             ValueOf value_of) {
  std::vector<double> values;
  for (const RowIndex row : rows) {
    if (const std::optional<double> value = value_of(inputs[row])) values.push_back(*value);
  }
  return values;
}

model::Interval TorquesOf(const PerRow<RowInputs>& inputs, const FitRows& rows, std::size_t joint) {
  const auto at = static_cast<Eigen::Index>(joint);
  return TorqueRange(ColumnOf(
      inputs, rows, [at](const RowInputs& row) { return std::optional<double>(row.tau[at]); }));
}

Measured PayloadsOf(const PerRow<RowInputs>& inputs, const FitRows& rows) {
  constexpr double kGap = 0.1;  // of the range: nearer loads show what is between them
  return RangeOf(ColumnOf(inputs, rows, std::mem_fn(&RowInputs::payload_kg)), kGap);
}

constexpr double kConnected = 1;  // one interval

Measured TemperaturesOf(const PerRow<RowInputs>& inputs, const FitRows& rows) {
  return RangeOf(ColumnOf(inputs, rows, std::mem_fn(&RowInputs::temp_C)), kConnected);
}

Measured TimesOf(const PerRow<RowInputs>& inputs, const FitRows& rows) {
  return RangeOf(ColumnOf(inputs, rows, std::mem_fn(&RowInputs::t_s)), kConnected);
}

}  // namespace

InputUnits UnitsOf(const PerRow<RowInputs>& inputs, const FitRows& rows,
                   const std::vector<double>& levers) {
  constexpr double kLeastShare = 0.1;  // of the largest range of any joint
  InputUnits units;
  std::vector<double> widths;
  double largest = 0;
  for (std::size_t joint = 0; joint < levers.size(); ++joint) {
    widths.push_back(levers[joint] > 0 ? TorquesOf(inputs, rows, joint).Width() : 0);
    largest = std::max(largest, widths.back());
  }
  for (std::size_t joint = 0; joint < levers.size(); ++joint)
    units.per_Nm.push_back(
        largest > 0 ? levers[joint] / std::max(widths[joint], kLeastShare * largest) : 0);
  if (const Measured loads = PayloadsOf(inputs, rows)) {
    const double range = std::max(loads->Hull().high, 0.0) - std::min(loads->Hull().low, 0.0);
    const auto gaps = std::max<std::size_t>(1, loads->intervals.size() - 1);
    if (range > 0) units.per_kg = static_cast<double>(gaps) / range;
  }
  if (const Measured warmth = TemperaturesOf(inputs, rows))
    units.per_K = 1 / std::max(kLeastTemperatureRange_K, warmth->Hull().Width());
  const Measured times = TimesOf(inputs, rows);
  if (times && times->Hull().Width() > 0) units.per_s = 1 / times->Hull().Width();
  return units;
}

InputsOfRows InputsOf(const Dataset& data, const Model& model, const PerRow<double>& weights) {
  InputsOfRows inputs;
  Indexed<SessionIndex, deflection::LoadedArm> arms;  // gravity in the base depends on its frame
  for (const SessionIndex session : data.sessions.indices())
    arms.emplace_back(CellOf(data, model, session));
  const bool loads = data.loads_recorded();
  std::vector<model::JointVector> poses;
  FitRows accepted;
  for (const RowIndex row : data.row_indices()) {
    const effects::Conditions& moment = data.conditions[row];
    poses.push_back(data.measured(row).q);
    const deflection::OperatingPoint at =
        arms[data.session_of[row]].PointAt(poses.back(), data.payloads[row], moment);
    RowInputs& own = inputs.rows.emplace_back(RowInputs{at.tau, {}, at.temp_C, at.t_s});
    if (loads) own.payload_kg = moment.payload_kg;
    if (weights[row] >= kOutlierWeight) accepted.push_back(row);
  }
  const deflection::LoadedArm& arm = arms.front();
  const kinematics::PoseDistance distance = DistanceFrom(data.cell, poses);
  std::vector<double> levers;
  for (int joint = 0; joint < arm.size(); ++joint)
    levers.push_back(arm.loads().known(joint) ? distance.weight(joint) : 0);
  inputs.units = UnitsOf(inputs.rows, accepted, levers);
  return inputs;
}

InputRanges::InputRanges(const InputsOfRows& inputs, const FitRows& rows)
    : units_(inputs.units),
      payload_kg_(PayloadsOf(inputs.rows, rows)),
      temp_C_(TemperaturesOf(inputs.rows, rows)),
      t_s_(TimesOf(inputs.rows, rows)) {
  for (std::size_t joint = 0; joint < units_.per_Nm.size(); ++joint)
    torques_.push_back(TorquesOf(inputs.rows, rows, joint));
}

BeyondRanges InputRanges::Beyond(const RowInputs& row) const {
  double torque = 0;
  for (std::size_t joint = 0; joint < torques_.size(); ++joint) {
    const double tau = row.tau[static_cast<Eigen::Index>(joint)];
    torque += std::pow(units_.per_Nm[joint] * torques_[joint].DistanceOf(tau), 2);
  }
  return {torque, SquaredBeyond(payload_kg_, row.payload_kg, units_.per_kg),
          SquaredBeyond(temp_C_, row.temp_C, units_.per_K),
          SquaredBeyond(t_s_, row.t_s, units_.per_s)};
}

void InputRanges::StateIn(model::Domain& domain, const std::optional<BeyondRanges>& growth_m,
                          bool with_time) const {
  const auto stated = [&](Measured measured, Input input, double per_unit) {
    if (measured && growth_m) measured->growth = per_unit * (*growth_m)[static_cast<int>(input)];
    return measured;
  };
  domain.payload_kg = stated(payload_kg_, Input::kPayload, units_.per_kg);
  domain.temp_C = stated(temp_C_, Input::kTemperature, units_.per_K);
  if (with_time) domain.t_s = stated(t_s_, Input::kTime, units_.per_s);
  domain.torques.clear();
  for (std::size_t joint = 0; growth_m && joint < torques_.size(); ++joint) {
    if (units_.per_Nm[joint] <= 0) continue;
    domain.torques.push_back(
        {static_cast<int>(joint), *stated(model::MeasuredRange{{torques_[joint]}, {}},
                                          Input::kTorque, units_.per_Nm[joint])});
  }
}

}  // namespace plumbline::measure
