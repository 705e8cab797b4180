// Covariance of the predicted tip.
#pragma once

#include <vector>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::deflection {

using statistics::RadiusHolding95Percent;

/// Covariance of the tip in B [m^2] due to the resolution of the joint registers: uniform within a
/// step, variance resolution^2 / 12.
/// @param resolution  of each joint [rad]
Mat3 ReadingCovariance(const LoadedArm& arm, const LoadedState& state, double resolution);

/// Scratch memory for EffectCovariance, sized for the effects of one arm.
struct EffectScratch {
  explicit EffectScratch(const LoadedArm& arm);
  std::vector<effects::Dual> values;
  /// d(influence)/d(parameter), one column per parameter of all effects in turn.
  Eigen::Matrix<double, effects::Influence<double>::kSize, Eigen::Dynamic> slopes;
  Eigen::Matrix<double, 3, Eigen::Dynamic> columns, weighted;
};

/// Covariance of the measured tip position in W [m^2] due to the parameter covariances of the
/// cell's effects:
///   C = share^2 sum_e J_e Sigma_e J_e^T
/// with J_e the derivative of the tip with respect to the parameters of effect e, and share the
/// part of the effects that applies at this distance from the fitted rows (error_growth.h). An
/// effect without a covariance contributes nothing. Zero if the deflected posture does not
/// converge.
Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions);
/// The same without allocation.
Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions,
                      EffectScratch& scratch);

}  // namespace plumbline::deflection
