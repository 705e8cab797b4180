// Detection limits: the smallest detectable value of each effect, and what the rows cannot show.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/search.h"

namespace plumbline::measure {

/// Adds to `diagnosis.minimum_detectable_m` the smallest 3-D RMS displacement over the rows [m] at
/// which an effect is detected with power 0.9, in the worst case over its joints, directions and
/// variants:
///   size = max over columns of (sqrt(cost) + 1.28) rms(column) / |projected column|
/// where the column is whitened and projected orthogonally to the free frames, and `cost` is the
/// score that naming the effect costs (for a searched shape, including the search over all shapes).
/// A joint or direction that would require a value beyond the plausible range is undetectable: it
/// is excluded from the maximum and named in a note. Of the shapes, those that the search proposed
/// are evaluated, and one and two cycles per turn of every joint.
void AddDetectable(const CandidateSet& candidate_set, const Candidates& candidates,
                   Diagnosis& diagnosis);

}  // namespace plumbline::measure
