#include "firmware-like/deflection/uncertainty.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/deflection/sensitivity.h"

namespace plumbline::deflection {

Mat3 ReadingCovariance(const LoadedArm& arm, const LoadedState& state, double resolution) {
  kinematics::Jacobian jacobian;
  arm.chain().JacobianAt(state.posture, state.X_BT.p, jacobian);
  return resolution * resolution / 12 * jacobian.topRows<3>() * jacobian.topRows<3>().transpose();
}

namespace {

bool HasCovariance(const effects::ActiveEffect& active) {
  return active.covariance.rows() == static_cast<Eigen::Index>(active.values.size());
}

/// Writes d(influence)/d(parameter) of one effect to `slopes` and adds its nonzero entries to
/// `touched`.
void SlopesOf(const effects::ActiveEffect& active, const effects::Conditions& moment,
              std::span<effects::Dual> values, Eigen::Ref<Eigen::MatrixXd> slopes,
              InfluenceSet& touched) {
  const auto count = static_cast<int>(values.size());
  for (int first = 0; first < count; first += effects::kDualWidth) {
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = effects::Dual(active.values[k]);
    const int last = std::min(count, first + effects::kDualWidth);
    for (int k = first; k < last; ++k) values[k].v[k - first] = 1;
    effects::Influence<effects::Dual> slope;
    active.term.effect->Add(active.term, values, moment, slope);
    for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
      for (int k = first; k < last; ++k) {
        slopes(entry, k) = slope[entry].v[k - first];
        if (slopes(entry, k) != 0) touched.set(static_cast<std::size_t>(entry));
      }
    }
  }
}

}  // namespace

EffectScratch::EffectScratch(const LoadedArm& arm) {
  std::size_t most = 0, all = 0;
  for (const effects::ActiveEffect& active : arm.effects()) {
    most = std::max(most, active.values.size());
    all += active.values.size();
  }
  values.resize(most);
  slopes.resize(Eigen::NoChange, static_cast<Eigen::Index>(all));
  columns.resize(3, static_cast<Eigen::Index>(most));
  weighted.resize(3, static_cast<Eigen::Index>(most));
}

Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions) {
  EffectScratch scratch(arm);
  return EffectCovariance(arm, q, payload, conditions, scratch);
}

Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions,
                      EffectScratch& scratch) {
  Mat3 covariance = Mat3::Zero();
  if (arm.effects().empty()) return covariance;
  effects::Conditions moment = arm.ConditionsAt(q, conditions);
  const effects::Influence<double> influence = arm.EffectsAt(moment);
  InfluenceSet touched;
  Eigen::Index at = 0;
  for (const effects::ActiveEffect& active : arm.effects()) {
    if (!HasCovariance(active)) continue;
    moment.t_s = effects::ClampedToFittedTime(active, conditions.t_s);
    const auto count = static_cast<Eigen::Index>(active.values.size());
    SlopesOf(active, moment, std::span(scratch.values.data(), active.values.size()),
             scratch.slopes.middleCols(at, count), touched);
    at += count;
  }
  if (touched.none()) return covariance;
  Sensitivity sensitivity;
  if (!SensitivityAt(arm, q, payload, influence, moment.tau, touched, sensitivity)) {
    return covariance;
  }
  at = 0;
  for (const effects::ActiveEffect& active : arm.effects()) {
    if (!HasCovariance(active)) continue;
    const auto count = static_cast<Eigen::Index>(active.values.size());
    auto columns = scratch.columns.leftCols(count);
    auto weighted = scratch.weighted.leftCols(count);
    columns = sensitivity.dp.lazyProduct(scratch.slopes.middleCols(at, count));
    weighted = columns.lazyProduct(active.covariance);
    covariance += weighted.lazyProduct(columns.transpose());
    at += count;
  }
  const double share = arm.growth().Share(q);
  return share * share * covariance;
}

namespace {

/// True for a load that is not one of the few measured ones. With measurements at only two loads, a
/// deflection proportional to the load, one with its square, and a clearance that any load takes up
/// fit equally well, but differ between these loads.
bool BetweenLevels(const model::Domain& domain, double payload_kg) {
  constexpr double kSameLoad = 0.05;  // of the range of the loads
  const std::vector<double>& levels = domain.payload_levels_kg;
  if (levels.size() < 2) return false;
  const double tolerance_kg = kSameLoad * (levels.back() - levels.front());
  return std::ranges::none_of(
      levels, [&](double level) { return std::abs(payload_kg - level) <= tolerance_kg; });
}

}  // namespace

bool ToolCovered(const model::CellModel& cell, int tool) {
  if (!cell.domain || cell.domain->tools.empty()) return true;
  const std::vector<int>& tools = cell.domain->tools;
  return std::ranges::find(tools, cell.ToolAt(tool).number) != tools.end();
}

bool ItemCovered(const model::CellModel& cell, int item) {
  if (!cell.domain) return true;
  if (!cell.domain->payload_items) return item == 0;
  const std::vector<int>& items = *cell.domain->payload_items;
  return std::ranges::find(items, item) != items.end();
}

namespace {

/// Visits the inputs outside the domain until `visit` returns true.
/// @return whether it did
template <typename Visit>
bool VisitExits(const model::CellModel& cell, const OperatingPoint& at, Visit visit) {
  using Input = DomainExit::Input;
  const auto leaves = [&visit](Input input, std::size_t index, double value,
                               const model::Interval& range) {
    return !range.Contains(value) && visit(DomainExit{input, index, value, range});
  };
  const auto leaves_known = [&leaves](Input input, const std::optional<double>& value,
                                      const std::optional<model::Interval>& range,
                                      std::size_t index = 0) {
    return range && value && leaves(input, index, *value, *range);
  };
  for (std::size_t k = 0; k < cell.robot.joints.size(); ++k) {
    const model::Joint& joint = cell.robot.joints[k];
    const model::Interval range =
        cell.domain ? cell.domain->q[k] : model::Interval{joint.min, joint.max};
    if (leaves(Input::kJoint, k, at.q[static_cast<Eigen::Index>(k)], range)) return true;
  }
  if (!cell.domain) return false;
  const model::Domain& domain = *cell.domain;
  for (std::size_t k = 0; k < domain.combinations.size(); ++k) {
    const model::JointCombination& combination = domain.combinations[k];
    const double sum = combination.weights.dot(at.q);
    if (leaves(Input::kJointCombination, k, sum, combination.range)) return true;
  }
  for (std::size_t k = 0; k < cell.effects.size(); ++k) {
    if (leaves_known(Input::kTime, at.t_s, cell.effects[k].seen_t_s, k)) return true;
  }
  if (!ToolCovered(cell, at.tool) && visit(DomainExit{Input::kTool})) return true;
  if (!ItemCovered(cell, at.item) && visit(DomainExit{Input::kItem})) return true;
  if (leaves_known(Input::kPayload, at.payload_kg, domain.payload_kg)) return true;
  if (leaves_known(Input::kTemperature, at.temp_C, domain.temp_C)) return true;
  if (at.payload_kg && BetweenLevels(domain, *at.payload_kg) &&
      visit(DomainExit{Input::kPayloadLevel,
                       0,
                       *at.payload_kg,
                       {domain.payload_levels_kg.front(), domain.payload_levels_kg.back()}})) {
    return true;
  }
  constexpr double kMost = 1 + kLoadTolerance;
  return std::ranges::any_of(domain.joint_loads, [&](const model::JointLoad& load) {
    return load.joint < at.tau.size() &&
           leaves(Input::kJointLoad, static_cast<std::size_t>(load.joint), at.tau[load.joint],
                  {kMost * load.range.low, kMost * load.range.high});
  });
}

}  // namespace

bool OutsideDomain(const model::CellModel& cell, const OperatingPoint& at) {
  return VisitExits(cell, at, [](const DomainExit&) { return true; });
}

std::vector<DomainExit> DomainExits(const model::CellModel& cell, const OperatingPoint& at) {
  std::vector<DomainExit> exits;
  VisitExits(cell, at, [&exits](const DomainExit& exit) {
    exits.push_back(exit);
    return false;
  });
  return exits;
}

}  // namespace plumbline::deflection
