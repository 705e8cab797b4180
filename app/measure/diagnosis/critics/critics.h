// The critics of an answer before its validation.
#pragma once

#include <vector>

#include "app/measure/diagnosis/critics/reference_dependence.h"
#include "app/measure/diagnosis/hypotheses/contradictions.h"
#include "app/measure/diagnosis/hypotheses/declared_errors.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"

namespace plumbline::measure {

/// What the critics examine.
struct Examination {
  const Identified& found;
  const FitOfAllRows& fit;
  const TestedReferences& references;
  const std::vector<KeptWithout>& without_references;
  const DeclaredErrorSearch& declared_errors;
  const Diagnosis& answer;      ///< with findings, rivals, signals and detection limits
  double residual_sigma_m = 0;  ///< robust, one axis

  const Dataset& data() const { return fit.problem.data; }
  /// True if the residual is well above the noise.
  bool rough() const;
  /// True if the correction is useful although references may be wrong.
  bool useful() const { return references.CorrectionIsUseful(answer.rms_before_m); }
};

/// Folds the opinions of all critics; also states whether the declared noise is too small, which it
/// is if the residual exceeds it and nothing else is unknown.
void Criticise(const Examination& examined, Diagnosis& diagnosis);

}  // namespace plumbline::measure
