#include "firmware-like/deflection/landing_uncertainty.h"

#include <cmath>

#include "firmware-like/deflection/assumed_error.h"
#include "firmware-like/deflection/linear_range.h"
#include "firmware-like/effects/event_time_uncertainty.h"
#include "firmware-like/statistics/containment_radius.h"

namespace plumbline::deflection {
namespace {

/// Share of the mean square error beyond which the radius grows by more than a tenth: 1 - 1 /
/// 1.1^2.
constexpr double kShareThatMatters = 0.17;

/// Covariance for conditions that may lie before or after an event, because the event's time is
/// uncertain: the displacement caused by the event must lie within the 95 % radius.
Mat3 CovarianceOfUncertainEvents(const LoadedArm& arm, const model::JointVector& q,
                                 const loads::Payload& payload,
                                 const effects::Conditions& conditions) {
  constexpr double kZ = 1.959964;
  Mat3 covariance = Mat3::Zero();
  for (const effects::ActiveEffect& effect : arm.effects()) {
    const auto uncertainty = effects::UncertaintyOfEventTime(effect, conditions);
    if (!uncertainty) continue;
    effects::Conditions before = conditions, after = conditions;
    (uncertainty->is_row ? before.row : before.t_s) = uncertainty->between.low;
    (uncertainty->is_row ? after.row : after.t_s) = uncertainty->between.high;
    LoadedState earlier, later;
    if (!arm.AtCommanded(q, payload, before, earlier)) continue;
    if (!arm.AtCommanded(q, payload, after, later)) continue;
    const Vec3 moved_W = (later.p_read_W - earlier.p_read_W) / kZ;
    covariance += moved_W * moved_W.transpose();
  }
  return covariance;
}

/// Covariance for conditions that lack a column of an effect: the displacement caused by the effect
/// over its fitted range must lie within the 95 % radius.
Mat3 CovarianceOfMissingColumns(const LoadedArm& arm, const model::JointVector& q,
                                const loads::Payload& payload,
                                const effects::Conditions& conditions, const LoadedState& state) {
  constexpr double kZ = 1.959964;
  Mat3 covariance = Mat3::Zero();
  for (const effects::NeededColumn& needed : arm.needed_columns()) {
    if (!needed.MissingFrom(conditions)) continue;
    Vec3 farthest_W = Vec3::Zero();
    for (const double value : {needed.range.low, needed.range.high}) {
      LoadedState other;
      const auto moment = effects::WithColumn(conditions, needed.column, value);
      if (!arm.AtCommanded(q, payload, moment, other)) continue;
      const Vec3 moved_W = other.p_read_W - state.p_read_W;
      if (moved_W.norm() > farthest_W.norm()) farthest_W = moved_W;
    }
    covariance += farthest_W * farthest_W.transpose() / (kZ * kZ);
  }
  return covariance;
}

}  // namespace

LandingUncertainty::LandingUncertainty(const model::CellModel& cell, const LoadedArm& arm,
                                       const model::DeclaredDeviation& deviation)
    : fitted_(cell.domain.has_value()),
      as_validated_(fitted_ && cell.domain->as_validated),
      held_out_(fitted_ && cell.domain->residual_sigma_m.has_value()),
      tested_(held_out_ && !arm.read_by_range()),
      deviation_stated_(deviation.stated),
      covariance_share_(fitted_ ? cell.domain->covariance_share : 1),
      residual_sigma_m_(held_out_ ? *cell.domain->residual_sigma_m
                                  : cell.measurement.sigma_m.value_or(0.0)),
      assumed_(std::make_unique<AssumedError>(cell, arm, deviation.share)),
      scratch_(arm) {}

LandingUncertainty::~LandingUncertainty() = default;
LandingUncertainty::LandingUncertainty(LandingUncertainty&&) noexcept = default;

model::StatedRadius LandingUncertainty::At(const LoadedArm& arm, const model::JointVector& q,
                                           const LoadStatement& load,
                                           const effects::Conditions& conditions, bool extrapolated,
                                           const Vec3& p_TP) {
  if (!arm.AtCommanded(q, load.modelled, conditions, state_)) return {};
  const Mat3 effects_W =
      covariance_share_ * EffectCovariance(arm, q, load.modelled, conditions, scratch_) +
      CovarianceOfUncertainEvents(arm, q, load.modelled, conditions) +
      CovarianceOfMissingColumns(arm, q, load.modelled, conditions, state_);
  if (!fitted_) return Assumed(arm, q, load, conditions, p_TP, effects_W);
  const double grown_m2 = held_out_ ? arm.growth().Variance(q) : 0;
  const double variance_m2 = residual_sigma_m_ * residual_sigma_m_ + grown_m2;
  const Mat3 covariance = effects_W + variance_m2 * Mat3::Identity();
  const model::RadiusBasis basis =
      tested_ ? model::RadiusBasis::kMeasured : model::RadiusBasis::kPropagated;
  const model::StatedRadius inside{statistics::RadiusHolding95Percent(covariance),
                                   as_validated_ ? basis : model::RadiusBasis::kAssumed};
  if (!extrapolated && as_validated_) return inside;
  const model::StatedRadius outside = Assumed(arm, q, load, conditions, p_TP, Mat3::Zero());
  return {std::hypot(inside.radius_m, outside.radius_m),
          model::Weakest(inside.basis, outside.basis)};
}

model::StatedRadius LandingUncertainty::Assumed(const LoadedArm& arm, const model::JointVector& q,
                                                const LoadStatement& load,
                                                const effects::Conditions& conditions,
                                                const Vec3& p_TP, const Mat3& covariance_W) {
  effects::Conditions moment = conditions;
  moment.q = q;
  const AssumedError::Estimate error = assumed_->At(arm, state_, load, moment, p_TP, covariance_W);
  const double radius_m = error.radius_m + NeglectedByLinearTheory(arm, state_);
  if (!assumed_->priors().complete) return {radius_m, model::RadiusBasis::kUnknown};
  const bool propagated = deviation_stated_ && error.undeclared_share < kShareThatMatters;
  return {radius_m, propagated ? model::RadiusBasis::kPropagated : model::RadiusBasis::kAssumed};
}

}  // namespace plumbline::deflection
