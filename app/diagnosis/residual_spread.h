// Spread of newly measured points about their predictions, near the measured poses and away.
#pragma once

#include <optional>
#include <vector>

#include "app/diagnosis/validation.h"

namespace plumbline::diagnosis {

/// One axis, at a distance d [rad] from the measured poses (pose_distance.h):
///   sigma^2(d) = near^2 + (distant d)^2
/// and where the correction fades, as distance_growth.h has it.
struct ResidualSpread {
  double near_m = 0;
  double distant_m = 0;  ///< per radian
  /// Where the correction fades: of the declared model, away; widened as `distant_m` is, so that
  /// their ratio, and with it the share that is applied, is that of the most likely variances.
  std::optional<double> declared_m{};
};

/// What a written model carries: nothing beyond the declared one, a correction that acts
/// everywhere, or one that fades with the distance.
enum class Correction { kNone, kWritten, kFading };

/// The spread of held-out errors of every way, by maximum likelihood of normal errors with variance
///   near^2 + session^2 [rows of a session that the fit has not seen] + (distant d)^2,
/// d the distance of the row from the poses that its fit has seen; near at least `sigma_m`. A new
/// point belongs to a new session: session^2 counts in near_m.
///
/// Widened, in this order:
/// - distant and session by Student's factor for the regions and sessions that they were estimated
///   from: the next one is a draw from as few;
/// - as a whole, where regions or sessions show more than so much: what the distance does not
///   explain is expected everywhere, again with Student's factor;
/// - as a whole, until the held-out rows show with a confidence of 80 % that the radius holds 95 %
///   of new rows. Outliers count, for a robot that misses one point in ten by a millimetre will
///   miss one of the next ten, too; rows of one fold count as fewer where they err alike.
/// Where the correction fades, halves of the joint space count among the regions, for nothing else
/// tests it as far away; d^2 is counted from the reach; and in the last step the errors are those
/// of the faded correction.
///
/// Absent where neither a region nor a session could be held out: nothing then says how the model
/// does away from its poses.
/// @param problem  its weights: rows of outliers count in the last step alone
std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction);

}  // namespace plumbline::diagnosis
