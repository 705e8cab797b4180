// How far the loaded tip may land from where an identified model puts it; for the cycle.
#pragma once

#include "firmware-like/deflection/uncertainty.h"

namespace plumbline {

/// The 95 % radius of a model that was fitted to measured points (its cell names a [domain]):
///   C = sum_e J_e Sigma_e J_e^T + sigma^2 I
/// with the covariance of the effects' parameters (EffectCovariance) and sigma, what the model left
/// of rows that took no part in the fit, on one axis: the domain's residual, else the instrument's
/// repeatability. It is the radius for points measured with that instrument; for the tip itself it
/// is too large by the instrument's noise, which no measured point can be told without. Outside the
/// domain nothing was seen, and the declared share of each deflection counts again, in squares.
/// Holds its own scratch memory: Radius95_m() allocates nothing. Costs about ten postures
/// (LoadedArm::AtCommanded).
class LandingUncertainty {
 public:
  LandingUncertainty(const CellModel& cell, const LoadedArm& arm);

  /// False where the model is declared only; then DeflectionCovariance is all there is.
  bool identified() const { return identified_; }

  /// @param q                   joints commanded [rad]
  /// @param declared_radius_m   of DeflectionCovariance there
  /// @param extrapolated        outside the domain
  double Radius95_m(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                    const Conditions& conditions, double declared_radius_m, bool extrapolated);

 private:
  bool identified_;
  double residual_sigma_m_;
  EffectScratch scratch_;
};

}  // namespace plumbline
