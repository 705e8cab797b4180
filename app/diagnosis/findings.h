// What is told of an explanation: parameters, shares, rivals, and what was refused and why.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/refit.h"
#include "app/diagnosis/search.h"

namespace plumbline {

struct FindingsContext {
  const FitProblem& problem;
  const Pool& pool;
  const Explanation& best;
  const Refit& refit;
  const std::vector<Explanation>& ranked;
  const DiagnosisOptions& options;
};

/// False where a deviation is beyond all measure: the rows do not hold the parameter at all.
bool Writable(const Finding& finding);

/// Effects with values, covariance, p-values and plausibility.
void AddFindings(const FindingsContext& context, Diagnosis& diagnosis);

/// Explanations without a finding that fit as well once refitted; returns those that are told,
/// their scores those of the refits.
std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis);

/// Every candidate with its fate.
void AddConsidered(const FindingsContext& context, const Candidates& candidates,
                   Diagnosis& diagnosis);

/// Sessions' frames where they were estimated, and the range that the rows cover which were not
/// rejected.
void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis);

}  // namespace plumbline
