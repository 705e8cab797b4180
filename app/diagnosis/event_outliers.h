// Events of an explanation, against the reading that the rows which support them are outliers.
#pragma once

#include "app/diagnosis/elimination.h"

namespace plumbline {

/// An explanation without the events that only outliers support, and the weights that go with it.
struct WithoutOutlierEvents {
  RefittedExplanation kept;
  PerRow<double> weights;
  bool dropped = false;  ///< some event was; `weights` may then reject more than kMaxOutliers
};

/// Compares each event with its rival, that the rows are outliers, by Hampel's bounded loss over
/// all rows (a rejected row costs as much wherever it lies) plus the cost of the effects. Both are
/// refitted with weights of their own, at the noise that the middle of the rows shows: outliers in
/// runs raise it little, but the limit of one row in ten for rejection would leave some of them in
/// the fit, where a step from one run on explains a part of each. A step explains whole rows, and
/// wins by about 41 for each position that would else be rejected.
/// @param fit    rows and weights that the explanation was found with
/// @param refit  with a problem of other weights
WithoutOutlierEvents DropOutlierEvents(
    const FitProblem& fit, const CandidateSet& candidate_set, RefittedExplanation found,
    const std::function<Result<Refit>(const FitProblem&, const Explanation&)>& refit);

}  // namespace plumbline
