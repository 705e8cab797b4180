// Limits of an empirical curve: what its rows have seen and what it explains there.
#pragma once

#include <vector>

#include "app/diagnosis/fit_problem.h"
#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// Clamps the nodes of each carrier's curve n_k(u) to the values that the curve takes at rows of
/// whole or partial weight, and its size to
///   |n_k| <= max_rows |n_k(u) J_k| / sqrt(mean_rows |J_k|^2),
/// J_k the tip's gradient [m per unit of the carrier], the mean over all rows, or over those about
/// the node where the payload is the driver: at an average pose a node moves the tip no farther
/// than the curve was ever seen to move it. A polynomial's edge, or a row where the carrier has no
/// lever, otherwise leaves a node that no measurement bounds.
/// @param problem  rows below kOutlierWeight count as not seen
/// @param effect   an empirical term; others are left as they are
void BoundToRows(const FitProblem& problem, const Linearisation& linear, ActiveEffect& effect);

}  // namespace plumbline
