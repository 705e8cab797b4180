// Backward elimination among refitted effects.
#pragma once

#include <functional>

#include "app/measure/diagnosis/candidate_set.h"
#include "app/measure/diagnosis/refit.h"

namespace plumbline::measure {

/// An explanation and its refit.
struct RefittedExplanation {
  Explanation explanation;
  Refit refit;
};

/// Refits an explanation from its linear values.
using RefitExplanation = std::function<Result<Refit>(const Explanation&)>;

/// Explanations with more blocks than this are not refitted during the search. They have no
/// nameable cause, and refitting each of their parts would take longer than the search.
inline constexpr std::size_t kMaxRefittedBlocks = 6;

/// Drops units whose removal raises the refitted chi2 by less than their cost. The linear search
/// cannot find them: only when time constants, cycles and frames are free can the other effects
/// absorb what such a unit explained. A unit is kept if the refit without it needs a value that is
/// beyond kDiscardRatio or has an excluded sign. Explanations with more than kMaxRefittedBlocks
/// blocks are returned unchanged.
/// @param refitted  as columns of the candidate set
RefittedExplanation EliminateUnsupportedUnits(const CandidateSet& candidate_set,
                                              RefittedExplanation refitted,
                                              const RefitExplanation& refit);

}  // namespace plumbline::measure
