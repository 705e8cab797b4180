// Findings: the effects of the answer with values, uncertainties and p-values.
#pragma once

#include <vector>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/linear/refit.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/search.h"
#include "firmware-like/effects/written.h"

namespace plumbline::measure {

// Limits of an empirical curve to the values supported by its rows.

/// Clamps the nodes of each carrier's curve n_k(u) to the range that the curve takes at accepted
/// rows, and their size to
///   |n_k| <= max_rows |n_k(u) J_k| / sqrt(mean_rows |J_k|^2),
/// where J_k is the tip's gradient [m per unit of the carrier]. The mean is over all rows, or, if
/// the payload is a driver, over the rows near the node. At an average pose a node thus moves the
/// tip no farther than the curve does at any row. Without this, the edge of a polynomial, or rows
/// where the carrier has no lever arm, leave nodes that no measurement bounds.
/// @param problem  rows with weights below kOutlierWeight are ignored
/// @param effect   an empirical term; other effects are not changed
void BoundToRows(const FitProblem& problem, const Linearisation& linear,
                 effects::ActiveEffect& effect);

// Displacement of the measured point by an effect.

/// RMS over rows of the distance between the predictions of the declared cell with and without an
/// effect [m].
struct TipDisplacement {
  double all_m = 0;            ///< by all values of the effect together
  std::vector<double> each_m;  ///< by each value with all other sizes at zero; 0 for a shape
};

/// Over at most 500 evenly spaced rows of the problem that are not outliers; errors of an
/// instrument that reads ranges displace nothing.
TipDisplacement TipDisplacementOf(const FitProblem& problem, const effects::ActiveEffect& effect);

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

/// Id and variant of a finding.
EffectKey KeyOfFinding(const Finding& finding);

/// Adds the effects with values, covariance, p-values and plausibility, and the correlation of all
/// their parameters.
void AddFindings(const FindingsContext& context, Diagnosis& diagnosis);

}  // namespace plumbline::measure
