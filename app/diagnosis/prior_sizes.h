// How large an effect's parameters are expected to be, before anything is measured.
#pragma once

#include <vector>

#include "app/diagnosis/linear_problem.h"

namespace plumbline::diagnosis {

/// Standard deviation of a prior about zero of each column of a block [SI of its parameter]. Where
/// a source says what real machines show (EffectTraits::seen_turn_rad), that; otherwise the
/// largest size that is plausible at all. What a source says of a joint is the angle that it turns
/// by: the size is the one that turns it so far where it does so most, over the problem's rows.
/// @param problem  linearised with the gradients of every influence
Indexed<BlockColumnIndex, double> PriorSizes(const LinearProblem& problem, const Block& block);

}  // namespace plumbline::diagnosis
