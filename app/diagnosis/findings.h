// The effects of an explanation with their values, their uncertainty and what each rests on.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/refit.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// The answer of a search, and what it was chosen from.
struct FindingsContext {
  const FitProblem& problem;
  const Pool& pool;
  const Explanation& best;
  const Refit& refit;    ///< of all rows: values and covariance
  double searched_chi2;  ///< of the same effects refitted to the rows of `problem`
  const std::vector<Explanation>& ranked;
  const DiagnosisOptions& options;
};

/// False where a deviation is beyond all measure: the rows do not hold the parameter at all.
bool Writable(const Finding& finding);

/// Adds the effects with values, covariance, p-values and plausibility, and the correlation of
/// their parameters.
void AddFindings(const FindingsContext& context, Diagnosis& diagnosis);

}  // namespace plumbline
