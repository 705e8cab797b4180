// Acceptance checks of an explanation.
#pragma once

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/validation/held_out.h"

namespace plumbline::measure {

/// Input of the checks in addition to the findings.
struct ExplanationEvidence {
  const FitProblem& problem;
  const HeldOut& held_out;       ///< held out by blocks of time
  double parameters = 0;         ///< fitted parameters, free frames and positions included
  double discrepancy_rms_m = 0;  ///< 3-D RMS of the discrepancy model over the rows [m]
  double residual_sigma_m = 0;   ///< standard deviation of the residual, one axis [m]
};

/// Mean of the squared held-out residuals over the variance of each row, weighted by the row's
/// number of lengths, and its upper limit under noise alone: the upper 0.1 % quantile of chi2 per
/// degree of freedom, with one degree of freedom for each length measured by an independent
/// cluster, times 1 + p / n for the p parameters estimated from the n lengths of the training
/// folds. Only folds whose own search selected all findings are evaluated, or all folds if there is
/// none.
struct HeldOutRatio {
  double ratio = 0, limit = 0;
  int clusters = 0;  ///< evaluated
};
HeldOutRatio HeldOutOverNoise(const ExplanationEvidence& evidence,
                              const std::vector<Finding>& findings);

/// True if a search selected the finding's effect with all of its joints.
bool SelectedWhole(const std::vector<SelectedEffect>& selected, const Finding& finding);

/// Share (0..1) of the folds whose own search selected an effect with all of its joints; nullopt if
/// no fold was searched.
std::optional<double> SelectionFrequency(const HeldOut& held_out, const Finding& finding);

/// Folds the opinions of the critics of a validated answer: the noise, each finding, the held-out
/// error and the discrepancy model. A finding that fails a check is doubtful. If the answer as a
/// whole fails, part of the residual is unexplained and the verdict is `unknown`. Without a
/// finding, only the residual is compared with the noise.
void CheckExplanation(const ExplanationEvidence& evidence, Diagnosis& diagnosis);

}  // namespace plumbline::measure
