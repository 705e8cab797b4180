// What would have been seen: the smallest size of each effect, and what these rows hide.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Smallest 3-D RMS displacement over the rows at which an effect is found with power 0.9,
/// whichever of its joints, directions and words it is in:
///   size = max over columns of (sqrt(cost) + 1.28) rms(column) / |column beside the frames|
/// with the whole cost of naming it, of a searched shape that of all shapes tried. A joint or
/// direction that would need more than a sound machine shows is hidden; it does not count, and a
/// note names it. Shapes are those that the search met, and one and two cycles of every joint.
void AddDetectable(const Pool& pool, const Candidates& candidates, Diagnosis& diagnosis);

}  // namespace plumbline
