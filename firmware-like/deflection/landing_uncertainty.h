// Expanded uncertainty of the predicted tip: 95 % radius with its basis.
#pragma once

#include <memory>
#include <optional>

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/loads/gravity.h"
#include "firmware-like/model/radius_basis.h"

namespace plumbline::deflection {

// Load used by the model, and which of its properties were stated.

struct LoadStatement {
  loads::Payload modelled;        ///< used by the model
  std::optional<double> mass_kg;  ///< stated by the robot, the configuration or a table
  bool centre_stated = false;     ///< the centre of gravity was stated

  /// A payload whose mass and centre of gravity were both stated.
  static LoadStatement Stated(const loads::Payload& payload) {
    return {payload, payload.mass_kg, payload.mass_kg > 0};
  }
};

class AssumedError;

/// 95 % radius of the attained tip position around the predicted one.
///
/// Fitted model (its cell has a [domain]), inside the domain:
///   C = c share^2(d) sum_e J_e Sigma_e J_e^T + sigma^2(d) I
/// with the covariance of the effects' parameters (EffectCovariance; c is Domain::covariance_share)
/// and sigma(d), the standard deviation per axis of the residual of held-out rows, which grows with
/// the distance d from the fitted rows (ErrorGrowth). The basis is `measured`. Without a
/// held-out residual, sigma is the instrument's and the basis is `propagated`. It is `propagated`
/// for ranges, too, because ranges validate the tip only along the wire; across it, only the
/// covariance is known. The radius applies to points measured with this instrument; for the tip
/// itself it is too large by the instrument's noise.
///
/// Any other model: the error is sampled from the priors of all undeclared parameters
/// (AssumedError), combined with the covariance of the effects. The basis is `propagated` if the
/// deviation of the declared deflections was stated and undeclared parameters enlarge the radius by
/// less than a tenth; `unknown` if some parameter has no prior; otherwise `assumed`. What linear
/// beam theory neglects (linear_range.h) is added, because it is systematic.
///
/// An effect whose column is missing from the conditions (t_s, temp_C) adds what it can do over its
/// fitted range.
///
/// Extrapolated points of a fitted model: the same radius, whose basis is `assumed`. Where the
/// growth does not describe the error (an unmeasured tool, a load although none was recorded), and
/// everywhere for a model that was changed after its fit (Domain::as_validated): the root of the
/// sum of squares of both radii, with the weaker basis; the covariance and the residual belong to
/// another model, and an edit must not shrink the radius. The instrument's noise then counts twice,
/// which is conservative.
///
/// Owns its scratch memory, so it is not thread-safe; At() takes some tens of microseconds. It does
/// not allocate, unless the conditions lack a column other than t_s and temp_C, which the daemon's
/// models never need.
class LandingUncertainty {
 public:
  LandingUncertainty(const model::CellModel& cell, const LoadedArm& arm,
                     const model::DeclaredDeviation& deviation);
  ~LandingUncertainty();
  LandingUncertainty(LandingUncertainty&&) noexcept;

  /// @param arm           must be the arm passed to the constructor
  /// @param q             commanded joints [rad] or [m]
  /// @param load          the modelled load and what is known about it
  /// @param extrapolated  outside the domain; ignored if the cell has no domain
  /// @param p_TP          tool point in the tip frame [m]; the covariance of a fitted model is
  ///                      always that of the tip
  /// @return              a radius whose known() is false if the loaded posture does not converge
  model::StatedRadius At(const LoadedArm& arm, const model::JointVector& q,
                         const LoadStatement& load, const effects::Conditions& conditions,
                         bool extrapolated, const Vec3& p_TP = Vec3::Zero());
  /// True if the radius beyond the fitted rows is that of the error's growth, without typical
  /// values.
  bool RestsOnGrowth(const LoadedArm& arm, const LoadStatement& load,
                     const OperatingPoint& point) const;

 private:
  model::StatedRadius Assumed(const LoadedArm& arm, const model::JointVector& q,
                              const LoadStatement& load, const effects::Conditions& conditions,
                              const Vec3& p_TP, const Mat3& covariance_W);

  bool fitted_;
  bool as_validated_;
  bool held_out_;  ///< the domain states a held-out residual
  bool tested_;    ///< that residual is one of positions, not of ranges
  bool deviation_stated_;
  double covariance_share_;
  double residual_sigma_m_;
  std::unique_ptr<AssumedError> assumed_;
  EffectScratch scratch_;
  LoadedState state_;
};

}  // namespace plumbline::deflection
