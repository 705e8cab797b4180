// Backward elimination among refitted effects.
#pragma once

#include <functional>

#include "app/diagnosis/pool.h"
#include "app/diagnosis/refit.h"

namespace plumbline {

/// An explanation and its refit.
struct RefittedExplanation {
  Explanation explanation;
  Refit refit;
};

/// Refits an explanation from its linear values.
using RefitExplanation = std::function<Result<Refit>(const Explanation&)>;

/// Drops the units that raise the refitted chi2 by less than they cost. The linear search cannot
/// know them: with time constants, cycles and frames free, the other effects may take over what a
/// unit explained while their shapes were fixed.
/// @param of  of the pool
RefittedExplanation WithoutUnearnedUnits(const Pool& pool, RefittedExplanation of,
                                         const RefitExplanation& refit);

}  // namespace plumbline
