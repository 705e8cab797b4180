// How far the loaded tip may land from where the model puts it, and what that statement rests on.
#pragma once

#include <memory>

#include "firmware-like/deflection/load_statement.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/model/radius_basis.h"

namespace plumbline {

class AssumedError;

/// The 95 % radius of a landing.
///
/// A model that was fitted to measured points (its cell names a [domain]), inside that domain:
///   C = c share^2(d) sum_e J_e Sigma_e J_e^T + sigma^2(d) I
/// with the covariance of the effects' parameters (EffectCovariance; c is Domain::covariance_share)
/// and sigma(d), the model's residual on one axis in rows that took no part in the fit, which grows
/// with the distance d from the measured poses (DistanceGrowth): basis `measured`. Without such a
/// residual sigma is the instrument's, and the basis `propagated`; so it is where ranges were
/// measured, which test the tip along the wire alone: across it the covariance is all that is
/// known. It is the radius for points measured with that instrument; for the tip itself it is too
/// large by the instrument's noise.
///
/// Any other model: the error sampled from the priors of all that the cell leaves open
/// (AssumedError), with the same covariance of its effects. The basis is `propagated` where the
/// deviation of the declared deflections was stated and what only priors describe makes the radius
/// less than a tenth larger; otherwise `assumed`; `unknown` where something has no prior either.
///
/// A fitted model outside its domain: both, in squares, with the weaker basis; the instrument's
/// noise then counts twice, which errs on the safe side. So also, everywhere and never better than
/// `assumed`, a model that was changed after its fit (Domain::as_validated): its covariance and
/// residual are those of another model, and an edit must not make the radius smaller.
///
/// Holds its own scratch memory: At() allocates nothing and costs some tens of microseconds.
class LandingUncertainty {
 public:
  LandingUncertainty(const CellModel& cell, const LoadedArm& arm,
                     const DeclaredDeviation& deviation);
  ~LandingUncertainty();
  LandingUncertainty(LandingUncertainty&&) noexcept;

  /// @param q             joints commanded [rad]
  /// @param load          what the model computes with, and what is known of it
  /// @param extrapolated  outside the domain; ignored if the cell has no domain
  /// @param p_TP          the tool point in the tip's frame [m]; a fitted model's covariance is
  /// that
  ///                      of the tip
  /// @return              not known() if the loaded posture does not settle
  StatedRadius At(const LoadedArm& arm, const JointVector& q, const LoadStatement& load,
                  const Conditions& conditions, bool extrapolated, const Vec3& p_TP = Vec3::Zero());

 private:
  StatedRadius Assumed(const LoadedArm& arm, const JointVector& q, const LoadStatement& load,
                       const Conditions& conditions, const Vec3& p_TP, const Mat3& covariance_W);

  bool fitted_;
  bool as_validated_;
  bool held_out_;  ///< the domain states a held-out residual
  bool tested_;    ///< of whole points
  bool deviation_stated_;
  double covariance_share_;
  double residual_sigma_m_;
  std::unique_ptr<AssumedError> assumed_;
  EffectScratch scratch_;
  LoadedState state_;
};

}  // namespace plumbline
