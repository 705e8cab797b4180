// Limits of an empirical curve to the values supported by its rows.
#pragma once

#include <vector>

#include "app/measure/diagnosis/fit_problem.h"
#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// Clamps the nodes of each carrier's curve n_k(u) to the range that the curve takes at accepted
/// rows, and their size to
///   |n_k| <= max_rows |n_k(u) J_k| / sqrt(mean_rows |J_k|^2),
/// where J_k is the tip's gradient [m per unit of the carrier]. The mean is over all rows, or, if
/// the payload is a driver, over the rows near the node. At an average pose a node thus moves the
/// tip no farther than the curve does at any row. Without this, the edge of a polynomial, or rows
/// where the carrier has no lever arm, leave nodes that no measurement bounds.
/// @param problem  rows with weights below kOutlierWeight are ignored
/// @param effect   an empirical term; other effects are not changed
void BoundToRows(const FitProblem& problem, const Linearisation& linear,
                 effects::ActiveEffect& effect);

}  // namespace plumbline::measure
