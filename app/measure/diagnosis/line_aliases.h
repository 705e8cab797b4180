// Aliases of spectral lines along a joint whose readings are equally spaced.
#pragma once

#include "app/measure/diagnosis/candidate_set.h"

namespace plumbline::measure {

/// Readings of a joint that are multiples of 2 pi / n apart cannot distinguish c cycles per turn
/// from |m n - c| or m n + c for any integer m: the lines coincide at the readings and differ only
/// between them. Adds, for every line of the answer and of the explanations that score nearly as
/// well, the explanations with the slowest such lines in its place; `ranked` remains sorted by
/// score. Nothing is added if the readings are spread.
/// @param best  the answer, as columns of `candidate_set`
void AddLineAliases(CandidateSet& candidate_set, const Explanation& best,
                    std::vector<Explanation>& ranked);

}  // namespace plumbline::measure
