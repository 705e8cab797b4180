// Spread of newly measured points about their predictions, near the measured poses and away.
#pragma once

#include <optional>
#include <vector>

#include "app/diagnosis/validation.h"

namespace plumbline {

/// One axis, at a distance d [rad] from the measured poses (pose_distance.h):
///   sigma^2(d) = near^2 + (distant d)^2
struct ResidualSpread {
  double near_m = 0;
  double distant_m = 0;  ///< per radian
};

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
/// - as a whole, until the held-out rows do not refute the 95 % radius, those among them that the
///   fit rejected: a robot that misses one point in ten by a millimetre will miss one of the next
///   ten, too.
/// Absent where neither a region nor a session could be held out: nothing then says how the model
/// does away from its poses.
/// @param problem    its weights: rows of outliers count in the last step alone
/// @param corrected  whether the correction is written; else the declared model's errors count
std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       bool corrected);

}  // namespace plumbline
