// Backward elimination among refitted effects.
#pragma once

#include <functional>

#include "app/diagnosis/candidate_set.h"
#include "app/diagnosis/refit.h"

namespace plumbline::diagnosis {

/// An explanation and its refit.
struct RefittedExplanation {
  Explanation explanation;
  Refit refit;
};

/// Refits an explanation from its linear values.
using RefitExplanation = std::function<Result<Refit>(const Explanation&)>;

/// Blocks of an explanation that is refitted in the course of a search. One of more has no cause
/// that anybody would name, and refitting each of its parts takes longer than the search.
inline constexpr std::size_t kMaxRefittedBlocks = 6;

/// Drops the units that raise the refitted chi2 by less than they cost. The linear search cannot
/// know them: with time constants, cycles and frames free, the other effects may take over what a
/// unit explained while their shapes were fixed. None is dropped where the refit of the others
/// needs a size beyond kDiscardRatio or of an excluded sign. Explanations of more than
/// kMaxRefittedBlocks stay.
/// @param of  of the candidate set
RefittedExplanation WithoutUnearnedUnits(const CandidateSet& candidate_set, RefittedExplanation of,
                                         const RefitExplanation& refit);

}  // namespace plumbline::diagnosis
