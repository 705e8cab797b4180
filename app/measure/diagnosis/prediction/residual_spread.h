// Variance model of the residuals of new points as a function of the distance from the measured
// poses.
#pragma once

#include <optional>
#include <vector>

#include "app/measure/diagnosis/validation/held_out.h"

namespace plumbline::measure {

/// Standard deviation of one axis at a distance d [rad] from the measured poses (pose_distance.h):
///   sigma^2(d) = near^2 + (distant d)^2
/// For a correction that fades, see loaded_arm.h.
struct ResidualSpread {
  double near_m = 0;
  double distant_m = 0;  ///< per radian
  /// Set if the correction fades: standard deviation of the declared model far away. It is widened
  /// like `distant_m`, so that their ratio, which determines the applied share of the correction,
  /// remains that of the maximum likelihood estimate.
  std::optional<double> declared_m{};
};

/// Correction in a written model: none, acting everywhere, or fading with the distance from the
/// measured poses.
enum class Correction { kNone, kWritten, kFading };

/// Estimates the spread from the held-out errors of all schemes by maximum likelihood, for normal
/// errors with variance
///   near^2 + session^2 [if the row's session was held out] + (distant d)^2,
/// where d is the distance of the row from the training poses of its fold and near >= `sigma_m`.
/// New points belong to a new session, so near_m includes session^2.
///
/// The estimate is then widened, in this order:
/// - distant and session by Student's factor for the number of regions and sessions from which they
/// were estimated;
/// - all components, if the errors of regions or sessions are larger than this model predicts:
/// errors that the distance does not explain are expected everywhere, again with Student's factor;
/// - all components, until the held-out rows show with a confidence of 80 % that the radius
/// contains 95 % of new rows. Outliers are included: a robot that misses one point in ten by a
/// millimetre will continue to do so. The effective number of rows is reduced if rows of one fold
/// have correlated errors. If the correction fades, the halves of the joint space are added to the
/// regions, since nothing else tests it that far away; d^2 is measured from the reach; and the last
/// step uses the errors of the faded correction.
///
/// nullopt if neither a region nor a session could be held out: the error away from the measured
/// poses is then unknown.
/// @param problem  rows with outlier weights are used in the last step only
std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction);

}  // namespace plumbline::measure
