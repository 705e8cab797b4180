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
  const effects::Influence<double> influence = arm.EffectsAt(moment, payload);
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
  const double share =
      arm.growth().fades() ? arm.growth().Share(arm.PointAt(q, payload, conditions)) : 1;
  return share * share * covariance;
}

}  // namespace plumbline::deflection
