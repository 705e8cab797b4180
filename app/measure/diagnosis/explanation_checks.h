// Acceptance checks of an explanation.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/held_out.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

// Check whether a finding rests on a single declared length of the artefacts.

/// A [[distance]] or the declared position, direction and radius of an artefact are references:
/// rows on artefacts are compared with them. Repeats the evaluation of the named effects with each
/// reference in turn treated as unknown. If a finding is then no longer worth its cost, an error of
/// that one value would have the same consequence as the effect, and nothing in the data
/// contradicts it: the check `references` of the finding fails, the finding is doubtful, and the
/// correction is withheld unless it is `useful` nevertheless
/// (TestedReferences::CorrectionIsUseful).
/// @param found  the answer whose findings are in `diagnosis`
Result<void> CheckReferences(const Identified& found, int threads, bool useful,
                             Diagnosis& diagnosis);

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

/// Id and variant of a finding.
EffectKey KeyOfFinding(const Finding& finding);

/// True if a search selected the finding's effect with all of its joints.
bool SelectedWhole(const std::vector<SelectedEffect>& selected, const Finding& finding);

/// Share (0..1) of the folds whose own search selected an effect with all of its joints; nullopt if
/// no fold was searched.
std::optional<double> SelectionFrequency(const HeldOut& held_out, const Finding& finding);

/// Adds the checks of each finding and of the whole answer to `diagnosis.checks`. A finding that
/// fails a check is added to `diagnosis.doubts` and lowers the verdict from `explained` to
/// `ambiguous`. If the answer as a whole fails, part of the residual is unexplained and the verdict
/// is `unknown`. Without a finding, only the residual is compared with the noise.
void CheckExplanation(const ExplanationEvidence& evidence, Diagnosis& diagnosis);

}  // namespace plumbline::measure
