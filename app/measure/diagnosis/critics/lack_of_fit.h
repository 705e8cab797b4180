// Lack of fit: whether the residual differs between poses by more than replicates scatter.
#pragma once

#include <optional>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"

namespace plumbline::measure {

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

/// The check `lack_of_fit`, if there are enough replicates. If it fails, the residual is not noise,
/// whatever was declared: the answer is `unknown`.
Opinion OpinionOnReplicates(const Identified& found, const FitOfAllRows& fit);

}  // namespace plumbline::measure
