// Prior standard deviations of effect parameters, for the design of measurements.
#pragma once

#include <vector>

#include "app/measure/diagnosis/linear_problem.h"

namespace plumbline::measure {

/// Standard deviation of a zero-mean prior of each column of a block [SI of its parameter]: from a
/// published value on real machines if there is one (EffectTraits::largest_observed_rotation_rad),
/// otherwise the largest plausible value. Published values are rotations of a joint; the parameter
/// is scaled so that it causes this rotation at the row where it rotates the joint most.
/// @param problem  linearised with the gradients of all entries of the influence
Indexed<BlockColumnIndex, double> PriorSizes(const LinearProblem& problem, const Block& block);

}  // namespace plumbline::measure
