// Loads on the compliant joints in the fitted rows.
#pragma once

#include <vector>

#include "app/diagnosis/fit_problem.h"
#include "app/diagnosis/linearisation.h"

namespace plumbline::diagnosis {

/// Poses that must load a joint in one direction, by at least a tenth of its largest load, before
/// the rows show how it yields in that direction.
inline constexpr int kMinPosesPerDirection = 5;

/// Each joint that yields, as declared or by an effect of `model`, and that fewer than
/// kMinPosesPerDirection poses load in one of the two directions: the range from zero to the
/// largest gravity torque in the other direction. Rejected rows do not count. Joints whose torque
/// is unknown, or below 1e-3 N m, are left out.
std::vector<model::JointLoad> JointLoadsOf(const FitProblem& problem, const Model& model);

}  // namespace plumbline::diagnosis
