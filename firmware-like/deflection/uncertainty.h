// How far the loaded tip may be from where the model puts it.
#pragma once

#include <vector>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline {

/// Covariance of a point of the posture [m^2] when each joint is read in steps of `resolution`
/// [rad]: uniform within a step, variance resolution^2 / 12.
Mat3 ReadingCovariance(const LoadedArm& arm, const LoadedState& state, double resolution);

/// Memory that EffectCovariance works in, large enough for the effects of one arm.
struct EffectScratch {
  explicit EffectScratch(const LoadedArm& arm);
  std::vector<Dual> values;
  /// d(influence)/d(parameter), a column each; the effects' parameters one after the other.
  Eigen::Matrix<double, Influence<double>::kSize, Eigen::Dynamic> slopes;
  Eigen::Matrix<double, 3, Eigen::Dynamic> columns, weighted;
};

/// Covariance of the measured tip position [m^2] in W by the deviations of the cell's effects,
///   C = share^2 sum_e J_e Sigma_e J_e^T, J_e the tip's derivative to the effect's parameters,
///   share
/// what the distance from the fitted poses leaves of them (distance_growth.h).
/// An effect without a covariance adds nothing. Zero where the sagged posture does not settle.
Mat3 EffectCovariance(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                      const Conditions& conditions);
/// The same; allocates nothing.
Mat3 EffectCovariance(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                      const Conditions& conditions, EffectScratch& scratch);

/// Radius [m] of the ball that holds 95 % of a zero-mean normal error of covariance C [m^2].
/// |e|^2 is taken as a chi^2_nu, a = tr(C^2)/tr(C), nu = tr(C)^2/tr(C^2) [Satterthwaite 1946], its
/// quantile by Wilson & Hilferty (chi_square.h). Within 2 % of the exact radius for every C.
double RadiusHolding95Percent(const Mat3& covariance);

/// True where q, payload or temperature lie outside what the model was fitted on, or the time
/// outside of what an effect of time was; where the cell names no domain, outside the joint limits.
bool OutsideDomain(const CellModel& cell, const JointVector& q, std::optional<double> payload_kg,
                   std::optional<double> temp_C, std::optional<double> t_s = std::nullopt);

}  // namespace plumbline
