// Signals that an unknown cause may follow as well as the one that was chosen.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Puts every other recorded signal in the place of each driver of an empirical term, refits, and
/// adds those that the rows do not rule out (kRivalGap) to the rivals of the diagnosis: where time
/// and temperature rise together, both are named.
/// @param best  of the pool; without an empirical term nothing is added
void AddDriverRivals(Pool& pool, const Explanation& best, Diagnosis& diagnosis);

}  // namespace plumbline
