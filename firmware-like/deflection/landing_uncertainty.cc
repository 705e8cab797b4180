#include "firmware-like/deflection/landing_uncertainty.h"

#include <cmath>

namespace plumbline {

LandingUncertainty::LandingUncertainty(const CellModel& cell, const LoadedArm& arm)
    : identified_(cell.domain.has_value()),
      residual_sigma_m_(identified_ ? cell.domain->residual_sigma_m.value_or(
                                          cell.measurement.sigma_m.value_or(0.0))
                                    : 0.0),
      scratch_(arm) {}

double LandingUncertainty::Radius95_m(const LoadedArm& arm, const JointVector& q,
                                      const Payload& payload, const Conditions& conditions,
                                      double declared_radius_m, bool extrapolated) {
  if (!identified_) return declared_radius_m;
  const Mat3 covariance = EffectCovariance(arm, q, payload, conditions, scratch_) +
                          residual_sigma_m_ * residual_sigma_m_ * Mat3::Identity();
  const double radius_m = RadiusHolding95Percent(covariance);
  return extrapolated ? std::hypot(radius_m, declared_radius_m) : radius_m;
}

}  // namespace plumbline
