// Rival explanations that the rows cannot rule out, and the effects that were not selected.
#pragma once

#include <vector>

#include "app/measure/diagnosis/search/findings.h"
#include "app/measure/diagnosis/search/search.h"

namespace plumbline::measure {

/// Refits the other ranked explanations that replace some finding, and adds those within kRivalGap
/// of the answer to `diagnosis.rivals`.
/// @return  the added explanations, with the scores of their nonlinear refits
std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis);

/// Replaces each driver of an empirical term by every other recorded signal, refits, and adds the
/// alternatives that the rows do not rule out (kRivalGap) to the rivals of the diagnosis. If time
/// and temperature rise together, for example, both are reported.
/// @param candidate_set  extended by the blocks of the alternatives
/// @param best           explanation, as columns of `candidate_set`; nothing is added if it has no
///                       empirical term
void AddDriverRivals(CandidateSet& candidate_set, const Explanation& best, Diagnosis& diagnosis);

/// Every effect of the catalogue with the share that it explains alone and the reason why it was
/// selected or rejected.
/// @param rivals  of the answer
std::vector<CandidateOutcome> CandidateOutcomes(const FindingsContext& context,
                                                const Candidates& candidates,
                                                const std::vector<Rival>& rivals);

}  // namespace plumbline::measure
