// Joint nonlinear refit of the shapes and sizes of an explanation.
#pragma once

#include "app/measure/diagnosis/candidate_set.h"

namespace plumbline::measure {

/// Refits an explanation to the rows of the candidate set's problem. Searched shapes are replaced
/// by the refitted ones, so that, for example, a time constant and a step are estimated jointly
/// instead of one after the other; units that become superfluous are removed. Adds the refitted
/// blocks to the candidate set. Returns the given explanation if the refit fails or does not score
/// better.
Explanation WithRefittedShapes(CandidateSet& candidate_set, const Explanation& chosen);

}  // namespace plumbline::measure
