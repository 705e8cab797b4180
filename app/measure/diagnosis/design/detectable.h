// Detection limits: the smallest detectable size of each effect, and what the rows cannot show.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/measure/diagnosis/linear/candidate_set.h"
#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// What the rows can show: the smallest detectable size of each effect, and what they cannot show.
struct DetectionLimits {
  std::map<std::string, double> minimum_detectable_m;  ///< 3-D RMS over the rows, by id
  std::vector<NotObservable> not_observable;
};

/// The smallest 3-D RMS displacement over the rows [m] at which an effect is detected with power
/// 0.9, in the worst case over its joints, directions and variants:
///   size = max over columns of (sqrt(cost) + 1.28) rms(column) / |projected column|
/// where the column is whitened and projected orthogonally to the free frames, and `cost` is the
/// score that naming the effect costs (for a searched shape, including the search over all shapes).
/// A joint or direction that would require a value beyond the plausible range is undetectable: it
/// is excluded from the maximum and is not observable. Of the shapes, those that the search
/// proposed are evaluated, and one and two cycles per turn of every joint.
DetectionLimits DetectionLimitsOf(const CandidateSet& candidate_set, const Candidates& candidates);

}  // namespace plumbline::measure
