// Other recorded signals that could drive an empirical term equally well.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/search.h"

namespace plumbline::measure {

/// Replaces each driver of an empirical term by every other recorded signal, refits, and adds the
/// alternatives that the rows do not rule out (kRivalGap) to the rivals of the diagnosis. If time
/// and temperature rise together, for example, both are reported.
/// @param candidate_set  extended by the blocks of the alternatives
/// @param best           explanation, as columns of `candidate_set`; nothing is added if it has no
///                       empirical term
void AddDriverRivals(CandidateSet& candidate_set, const Explanation& best, Diagnosis& diagnosis);

}  // namespace plumbline::measure
