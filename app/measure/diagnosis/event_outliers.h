// Test of each event in an explanation against the alternative that its rows are outliers.
#pragma once

#include "app/measure/diagnosis/elimination.h"

namespace plumbline::measure {

/// An explanation without the events that only outliers support.
struct WithoutOutlierEvents {
  RefittedExplanation kept;
  bool dropped = false;  ///< an event was dropped; more rows than kMaxOutliers may be outliers
};

/// Compares each event with the alternative that its rows are outliers. The score is Hampel's
/// bounded loss over all rows, in which every rejected row costs the same, plus the cost of the
/// effects. Both alternatives are refitted with their own weights at the robust noise estimate,
/// which runs of outliers hardly raise. The usual limit of one rejected row in ten does not apply:
/// it would leave outliers in the fit, and a step could explain a part of each run. A true step
/// explains its rows completely and saves about 41 for each position otherwise rejected.
/// @param fit    rows and weights with which the explanation was found
/// @param refit  fits an explanation to a problem with other weights
WithoutOutlierEvents DropOutlierEvents(
    const FitProblem& fit, const CandidateSet& candidate_set, RefittedExplanation found,
    const std::function<Result<Refit>(const FitProblem&, const Explanation&)>& refit);

}  // namespace plumbline::measure
