#include "app/measure/diagnosis/validation/input_ranges.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"
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

/// The range of the values without `left_out` at each end, 0 included.
model::Interval TorqueRange(std::vector<double> values, std::size_t left_out) {
  std::ranges::sort(values);
  if (values.size() <= 2 * left_out) return {};
  return {std::min(0.0, values[left_out]), std::max(0.0, values[values.size() - 1 - left_out])};
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

/// The torque of a joint in each pose.
std::vector<double> TorquesOf(const PerRow<RowInputs>& inputs, const FitRows& rows,
                              std::size_t joint) {
  std::set<ClusterIndex> visited;
  return ColumnOf(inputs, rows, [&](const RowInputs& row) -> std::optional<double> {
    if (row.pose && !visited.insert(*row.pose).second) return std::nullopt;
    return row.tau[static_cast<Eigen::Index>(joint)];
  });
}

constexpr std::size_t kPosesLeftOut = 2;  // at each end of a range of torques

Measured PayloadsOf(const PerRow<RowInputs>& inputs, const FitRows& rows) {
  constexpr double kGap = 0.1;  // of the range: nearer loads show what is between them
  return RangeOf(ColumnOf(inputs, rows, std::mem_fn(&RowInputs::payload_kg)), kGap);
}

/// A limit that rounding does not pass.
model::Interval WithTolerance(const model::Interval& range) {
  constexpr double kShare = 0.02;  // of the width
  constexpr double kLeast_Nm = 1e-3;
  const double tolerance = std::max(kShare * range.Width(), kLeast_Nm);
  return {range.low - tolerance, range.high + tolerance};
}

model::Interval JointRange(const PerRow<RowInputs>& inputs, const FitRows& rows, int joint) {
  model::Interval range{HUGE_VAL, -HUGE_VAL};
  for (const RowIndex row : rows) {
    range.low = std::min(range.low, inputs[row].q[joint]);
    range.high = std::max(range.high, inputs[row].q[joint]);
  }
  return range;
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
    widths.push_back(
        levers[joint] > 0 ? TorqueRange(TorquesOf(inputs, rows, joint), kPosesLeftOut).Width() : 0);
    largest = std::max(largest, widths.back());
  }
  for (std::size_t joint = 0; joint < levers.size(); ++joint)
    units.per_Nm.push_back(
        largest > 0 ? levers[joint] / std::max(widths[joint], kLeastShare * largest) : 0);
  if (const Measured loads = PayloadsOf(inputs, rows)) {
    const model::Interval hull = loads->Hull();
    const auto gaps = static_cast<double>(loads->intervals.size()) - 1;
    const double unit =
        gaps > 0 ? hull.Width() / gaps : std::max(std::abs(hull.low), std::abs(hull.high));
    units.per_kg = unit > 0 ? 1 / unit : 0;
  }
  if (const Measured warmth = TemperaturesOf(inputs, rows))
    units.per_K = 1 / std::max(kLeastTemperatureRange_K, warmth->Hull().Width());
  const Measured times = TimesOf(inputs, rows);
  if (times && times->Hull().Width() > 0) units.per_s = 1 / times->Hull().Width();
  return units;
}

namespace {

/// Widens the yield of each joint by what it is at one row.
void AddYield(const deflection::LoadedArm& arm, const Model& model,
              const effects::Conditions& moment, const loads::Payload& payload,
              const model::JointVector& q, std::vector<double>& yield) {
  using Entries = effects::Influence<double>;
  Entries influence = arm.EffectsAt(moment, payload);
  effects::AddEffects(model.effects, moment, influence);
  kinematics::Posture posture;
  kinematics::Jacobian jacobian;
  arm.chain().Evaluate(q, posture);
  arm.chain().DriveJacobianAt(posture, posture.X_BF() * arm.X_FT(payload.tool).p, jacobian);
  for (int joint = 0; joint < arm.size(); ++joint) {
    const double slope = arm.compliance(joint) + influence.Joint(Entries::kCompliance, joint);
    double& own = yield[static_cast<std::size_t>(joint)];
    own = std::max(own, std::abs(slope) * jacobian.col(joint).head<3>().norm());
  }
}

}  // namespace

InputsOfRows InputsOf(const Dataset& data, const Model& model, const PerRow<double>& weights) {
  InputsOfRows inputs;
  Indexed<SessionIndex, deflection::LoadedArm> arms;  // gravity in the base depends on its frame
  for (const SessionIndex session : data.sessions.indices())
    arms.emplace_back(CellOf(data, model, session));
  const bool loads = data.loads_recorded();
  std::vector<model::JointVector> poses;
  FitRows accepted;
  inputs.yield.assign(static_cast<std::size_t>(arms.front().size()), 0);
  for (const RowIndex row : data.row_indices()) {
    const effects::Conditions& moment = data.conditions[row];
    const deflection::LoadedArm& arm = arms[data.session_of[row]];
    poses.push_back(data.measured(row).q);
    const deflection::OperatingPoint at = arm.PointAt(poses.back(), data.payloads[row], moment);
    RowInputs& own = inputs.rows.emplace_back(
        RowInputs{at.tau, data.cluster_of[row], {}, at.temp_C, at.t_s, poses.back()});
    if (loads) own.payload_kg = moment.payload_kg;
    if (weights[row] < kOutlierWeight) continue;
    accepted.push_back(row);
    AddYield(arm, model, moment, data.payloads[row], poses.back(), inputs.yield);
  }
  const deflection::LoadedArm& arm = arms.front();
  const kinematics::PoseDistance distance = DistanceFrom(data.cell, poses);
  constexpr double kLeastWeight = 1e-6;  // with less, the joint does not move the tip
  std::vector<double> levers;
  for (int joint = 0; joint < arm.size(); ++joint) {
    const double lever = arm.loads().known(joint) ? distance.weight(joint) : 0;
    levers.push_back(lever >= kLeastWeight ? lever : 0);
  }
  inputs.units = UnitsOf(inputs.rows, accepted, levers);
  for (int joint = 0; joint < arm.size(); ++joint) {
    inputs.units.per_rad.push_back(distance.lever(joint));
    inputs.units.turns.push_back(arm.chain().RepeatsAfterTurn(joint));
  }
  return inputs;
}

InputRanges::InputRanges(const InputsOfRows& inputs, const FitRows& rows)
    : units_(inputs.units),
      yield_(inputs.yield),
      payload_kg_(PayloadsOf(inputs.rows, rows)),
      temp_C_(TemperaturesOf(inputs.rows, rows)),
      t_s_(TimesOf(inputs.rows, rows)) {
  yield_.resize(units_.per_Nm.size(), 0);
  for (std::size_t joint = 0; joint < units_.per_Nm.size(); ++joint) {
    const std::vector<double> torques = TorquesOf(inputs.rows, rows, joint);
    torques_.push_back(TorqueRange(torques, kPosesLeftOut));
    all_torques_.push_back(TorqueRange(torques, 0));
  }
  for (int joint = 0; joint < static_cast<int>(units_.per_rad.size()); ++joint)
    joints_.push_back(JointRange(inputs.rows, rows, joint));
}

BeyondRanges InputRanges::Beyond(const RowInputs& row) const {
  double range = 0, torque = 0;
  for (std::size_t joint = 0; joint < joints_.size(); ++joint) {
    const double q = row.q[static_cast<Eigen::Index>(joint)];
    const double beyond = kinematics::DistanceBeyond(joints_[joint], q, units_.turns[joint]);
    range += std::pow(units_.per_rad[joint] * beyond, 2);
  }
  for (std::size_t joint = 0; joint < torques_.size(); ++joint) {
    const double tau = row.tau[static_cast<Eigen::Index>(joint)];
    torque += std::pow(units_.per_Nm[joint] * torques_[joint].DistanceOf(tau), 2);
  }
  BeyondRanges beyond;
  beyond << range, torque, SquaredBeyond(payload_kg_, row.payload_kg, units_.per_kg),
      SquaredBeyond(temp_C_, row.temp_C, units_.per_K), SquaredBeyond(t_s_, row.t_s, units_.per_s);
  return beyond;
}

void InputRanges::StateIn(model::Domain& domain, const std::optional<Growth>& growth) const {
  const auto stated = [&](Measured measured, ModelInput input, double per_unit) {
    if (measured && growth && per_unit > 0)
      measured->growth = per_unit * growth->per_unit_m[static_cast<int>(input)];
    return measured;
  };
  if (growth) domain.range_growth_m = growth->per_unit_m[static_cast<int>(ModelInput::kRange)];
  domain.payload_kg = stated(payload_kg_, ModelInput::kPayload, units_.per_kg);
  domain.temp_C = stated(temp_C_, ModelInput::kTemperature, units_.per_K);
  if (growth && growth->with_time) domain.t_s = stated(t_s_, ModelInput::kTime, units_.per_s);
  constexpr double kReversed = 0.1;  // of the range: less shows nothing of the other direction
  domain.torques.clear();
  for (std::size_t joint = 0; joint < torques_.size(); ++joint) {
    const double per_Nm = units_.per_Nm[joint];
    if (per_Nm <= 0) continue;
    model::MeasuredRange range{{growth ? torques_[joint] : WithTolerance(all_torques_[joint])}, {}};
    range = *stated(range, ModelInput::kTorque, per_Nm);
    const model::Interval& torques = torques_[joint];
    const bool one_direction = std::min(-torques.low, torques.high) < kReversed * torques.Width();
    if (growth && one_direction)
      range.growth = std::max({*range.growth, per_Nm * growth->untested_m, yield_[joint]});
    domain.torques.push_back({static_cast<int>(joint), range});
  }
}

}  // namespace plumbline::measure
