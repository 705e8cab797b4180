// Findings: the effects of the answer with values, uncertainties and p-values.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/refit.h"
#include "app/measure/diagnosis/search.h"

namespace plumbline::measure {

/// The selected explanation and the alternatives it was selected from.
struct FindingsContext {
  const FitProblem& problem;
  const CandidateSet& candidate_set;
  const Explanation& best;
  const Refit& refit;    ///< of all rows: values and covariance
  double searched_chi2;  ///< of the same effects, refitted to the rows of `problem`
  const std::vector<Explanation>& ranked;
  const DiagnosisOptions& options;
};

/// False if a standard deviation is absurdly large or not finite, that is, if the rows do not
/// determine a parameter at all.
bool HasUsableCovariance(const Finding& finding);

/// Adds the effects with values, covariance, p-values and plausibility, and the correlation of all
/// their parameters.
void AddFindings(const FindingsContext& context, Diagnosis& diagnosis);

}  // namespace plumbline::measure
