// Directions in which the fitted rows load the joints that yield.
#pragma once

#include <set>
#include <vector>

#include "app/measure/diagnosis/fit_problem.h"
#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// Poses that must load a joint in one direction before the rows show how it yields in it.
inline constexpr int kMinPosesPerDirection = 5;

/// Each joint that yields to its gravity torque tau by
///   s(tau) = c tau - hardening tau^3 + gap sign(tau)
/// as declared or by the effects of `model`, and that fewer than kMinPosesPerDirection poses load
/// in one of the two directions. A pose counts in a direction if its torque is at least a tenth of
/// the largest and moves the tip by at least the noise. The range goes from the torque that moves
/// the tip by the noise, in the direction that was not shown, to the largest torque in the other.
/// Rejected rows do not count. Joints that never move the tip by the noise are left out, and so are
/// those whose gravity torque is unknown because a link mass is not declared.
/// @param suspected  0-based joints of which a rival of the answer depends on the direction of the
///                   load: they count as if a gap moved the tip
std::vector<model::JointLoad> JointLoadsOf(const FitProblem& problem, const Model& model,
                                           const std::set<int>& suspected);

}  // namespace plumbline::measure
