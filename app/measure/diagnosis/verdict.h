// Verdict of a diagnosis: explained, ambiguous, unknown or no effect.
#pragma once

#include <optional>

#include "app/measure/diagnosis/dataset.h"
#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/diagnosis_stages.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

// Lack of fit: whether the residual differs between poses by more than replicates scatter.

/// Residual of a fit, divided into the scatter of replicates about the mean of their pose (pure
/// error, which no effect of the pose can cause) and the means of the poses (lack of fit) [Draper &
/// Smith, Applied Regression Analysis, 3rd ed. 1998, sec. 2.1]. Both as standard deviations of one
/// row, one axis: they are equal if the model lacks nothing. Lengths only; rejected rows do not
/// count.
struct LackOfFit {
  double replicates_m = 0;        ///< scatter of the replicates
  double replicates_freedom = 0;  ///< degrees of freedom
  double between_poses_m = 0;     ///< root mean square of the means, scaled to one row
  double between_poses_freedom = 0;
  /// The larger of the replicates' scatter, joint resolution and correlation of successive rows
  /// included, and the noise of the data set (Dataset::sigma_m).
  double noise_m = 0;
  /// Largest `between_poses_m` that is accepted: the upper 0.1 % quantile of F under this noise,
  /// and at least the value at which the lack of fit is half the noise. Heavy tails reduce the
  /// degrees of freedom by 1 + excess kurtosis / 2 [Box, Biometrika 40 (1953) 318].
  double limit_m = 0;

  bool significant() const { return between_poses_m > limit_m; }
};

/// @param residuals        of the named effects, measured minus predicted
/// @param weights          robust weights, 0..1
/// @param row_correlation  of the noise of successive rows, 0..1
/// @param parameters       fitted to these rows, free frames and artefact positions included
/// @return nullopt if fewer than 12 degrees of freedom remain within or between poses
std::optional<LackOfFit> LackOfFitOf(const Dataset& data, const PerRow<RowResidual>& residuals,
                                     const PerRow<double>& weights, double row_correlation,
                                     double parameters);

/// Adds all recorded signals, each with the p-value that the residual of the identified model
/// follows it (by sign flips of clusters), and the spectrum of the residual along each joint angle.
/// @param all  every row; supplies the reported values. The p-values are of the searched rows only.
void AddSignals(const Dataset& all, const Identified& found, Diagnosis& diagnosis);

/// Number of parameters fitted to the rows: of the named effects, free frames and positions of
/// artefacts, minus what is known about the positions.
double ParametersOf(const Identified& found, const Dataset& data);

/// Sets the verdict before the checks of the explanation (explanation_checks.h), the driver signals
/// of an unknown cause, and whether the declared noise is too small; adds the check `lack_of_fit`.
/// Requires `rivals` and `signals`.
void SetVerdict(const Identified& found, const FitOfAllRows& fit, Diagnosis& diagnosis);

}  // namespace plumbline::measure
