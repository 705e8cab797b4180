// Variance model of the residuals of new points as a function of the distance from the measured
// rows.
#pragma once

#include <optional>
#include <vector>

#include "app/measure/diagnosis/validation/held_out.h"

namespace plumbline::measure {

/// Variance of one axis at a distance d [rad] from the measured poses (pose_distance.h), r their
/// reach, and the
/// squared distances b beyond the other inputs' ranges (input_ranges.h):
///   sigma^2 = near^2 + distant^2 max(0, d^2 - r^2) + sum_i growth_i^2 b_i
/// For a correction that fades, see deflection/error_growth.h.
struct ResidualSpread {
  double near_m = 0;
  double distant_m = 0;  ///< per radian
  /// What there was to correct: standard deviation of the declared model's errors. The growth along
  /// what no row tests is at least this.
  double deviation_m = 0;
  BeyondRanges growth_m = BeyondRanges::Zero();  ///< per range of each input
  /// Set if the correction fades: standard deviation of the declared model far away. It is widened
  /// like the growths, so that their ratio, which determines the applied share of the correction,
  /// remains that of the estimate.
  std::optional<double> declared_m{};
};

/// Correction in a written model: none, acting everywhere, or fading with the distance from the
/// measured rows.
enum class Correction { kNone, kWritten, kFading };

/// Estimates the spread from the held-out errors of all schemes, for normal errors with variance
///   near^2 + session^2 [if the row's session was held out] + distant^2 max(0, d^2 - r^2)
///     + sum_i growth_i^2 b_i
/// and near >= `sigma_m`. New points belong to a new session, so near_m includes session^2.
///
/// The components are the mode of the posterior with an inverse gamma prior on each variance but
/// the first [Gelman, Bayesian Analysis 1 (2006) 515, on why few groups need one]: a held-out fold
/// counts as much as the prior, so that a component that no fold tests keeps what the prior says.
/// Its mode is the noise, plus the deviation of the declared model unless the causes of the
/// correction are confirmed: a confirmed law extrapolates, anything else may err by as much as
/// there was to correct. Along time, `drift_m` is added to it.
///
/// If the correction fades, its growth along the posture and the payload is multiplied by the
/// variance that the declared model leaves over that in the held-out region, or under the load,
/// that has the least: the share that is applied suits the place where there is least to correct.
///
/// All components then grow until the held-out rows show with a confidence of 80 % that the radius
/// contains 95 % of new rows. Outliers are included: a robot that misses one point in ten by a
/// millimetre will continue to do so. The effective number of rows is reduced if rows of one fold
/// have correlated errors. If the correction fades, the halves of the joint space are added to the
/// regions, since nothing else tests it that far away, and this step uses the errors of the faded
/// correction.
///
/// nullopt if neither a region nor a session could be held out: the error away from the measured
/// poses is then unknown.
/// @param problem  rows with outlier weights are used in the last step only
/// @param drift_m  displacement by the effects that follow time, RMS over the rows; absent: time is
///                 no input
std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction,
                                       std::optional<double> drift_m = std::nullopt);

}  // namespace plumbline::measure
