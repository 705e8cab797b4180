// Frames of an instrument and tip of a tool, found from the rows alone.
#pragma once

#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// Finds what the cell leaves free, for each session: the instrument's pose (any) and the tip
/// (the declared one may be 100 mm off), the effects of `model` acting. Of points globally: the
/// lifted linear problem p_W = R p_F + sum_l (R t)_l .. gives a start, the 24 right-angled poses
/// are others, and the best is kept. It is polished by Gauss-Newton on robust weights; of ranges
/// that is all, so that the declared pose must be near. Nothing is changed where the cell leaves
/// nothing free.
/// @return  an error where the rows cannot hold the frames
Result<Model> Aligned(const Dataset& data, const Model& model, int threads);

}  // namespace plumbline
