// Checks that an explanation passes before it is called one.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/held_out.h"

namespace plumbline {

/// What the checks judge, beside the findings themselves.
struct ExplanationEvidence {
  const FitProblem& problem;
  const HeldOut& held_out;       ///< by blocks of time
  double parameters = 0;         ///< fitted, of the named effects
  double discrepancy_rms_m = 0;  ///< 3-D, of what the discrepancy model adds at the rows
};

/// Mean square of held-out residuals over sigma^2, and the most that noise makes of it: the 0.1 %
/// quantile of chi2 with as many degrees of freedom as independent clusters measure lengths,
/// widened by what the parameters of a fit of the other folds cost, 1 + p / n. Of the folds whose
/// own search selected all the findings, if any did.
struct HeldOutRatio {
  double ratio = 0, limit = 0;
  int clusters = 0;  ///< that were predicted
};
HeldOutRatio HeldOutOverNoise(const ExplanationEvidence& evidence,
                              const std::vector<Finding>& findings);

/// Share (0..1) of the folds whose own search selected an effect in all of its joints; nothing
/// where none searched.
std::optional<double> SelectionFrequency(const HeldOut& held_out, const Finding& finding);

/// Adds the checks of every finding and of the whole answer. An effect that fails one becomes a
/// doubt. Where noise or the choice of rows may have brought it, the verdict falls from `explained`
/// to `ambiguous`; a value that no sound machine shows is doubted, but nothing else fits the rows.
/// Where the answer as a whole fails, something remains unexplained, and the verdict is `unknown`.
void CheckExplanation(const ExplanationEvidence& evidence, Diagnosis& diagnosis);

}  // namespace plumbline
