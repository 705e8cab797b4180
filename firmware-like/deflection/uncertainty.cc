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
    for (int k = first; k < last; ++k) values[static_cast<std::size_t>(k)].v[k - first] = 1;
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
  return std::none_of(levels.begin(), levels.end(),
                      [&](double level) { return std::abs(payload_kg - level) <= tolerance_kg; });
}

/// True if a compliant joint carries a load that the fitted rows did not put on it.
bool OutsideMeasuredLoads(const model::Domain& domain, const model::JointVector& tau) {
  return std::any_of(
      domain.joint_loads.begin(), domain.joint_loads.end(), [&](const model::JointLoad& load) {
        constexpr double kMost = 1 + kLoadTolerance;
        return load.joint < tau.size() &&
               !model::Interval{kMost * load.range.low, kMost * load.range.high}.Contains(
                   tau[load.joint]);
      });
}

}  // namespace

bool ToolCovered(const model::CellModel& cell, int tool) {
  if (!cell.domain || cell.domain->tools.empty()) return true;
  const std::vector<int>& tools = cell.domain->tools;
  return std::find(tools.begin(), tools.end(), cell.ToolAt(tool).number) != tools.end();
}

bool ItemCovered(const model::CellModel& cell, int item) {
  if (!cell.domain) return true;
  if (!cell.domain->payload_items) return item == 0;
  const std::vector<int>& items = *cell.domain->payload_items;
  return std::find(items.begin(), items.end(), item) != items.end();
}

bool OutsideDomain(const model::CellModel& cell, const OperatingPoint& at) {
  for (int i = 0; i < cell.robot.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const model::Joint& joint = cell.robot.joints[k];
    const model::Interval interval =
        cell.domain ? cell.domain->q[k] : model::Interval{joint.min, joint.max};
    if (!interval.Contains(at.q[i])) return true;
  }
  if (!cell.domain) return false;
  for (const model::JointCombination& combination : cell.domain->combinations) {
    if (!combination.range.Contains(combination.weights.dot(at.q))) return true;
  }
  const auto outside = [](const std::optional<model::Interval>& seen, std::optional<double> value) {
    return seen && value && !seen->Contains(*value);
  };
  for (const model::WrittenEffect& effect : cell.effects) {
    if (outside(effect.seen_t_s, at.t_s)) return true;
  }
  if (!ToolCovered(cell, at.tool) || !ItemCovered(cell, at.item)) return true;
  return outside(cell.domain->payload_kg, at.payload_kg) ||
         outside(cell.domain->temp_C, at.temp_C) ||
         (at.payload_kg && BetweenLevels(*cell.domain, *at.payload_kg)) ||
         OutsideMeasuredLoads(*cell.domain, at.tau);
}

}  // namespace plumbline::deflection
