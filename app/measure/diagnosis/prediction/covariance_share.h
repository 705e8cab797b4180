// Scale factor for covariances of jointly fitted effects that are written one by one.
#pragma once

#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// A written model holds one covariance per effect, without the correlations between effects and
/// with the frames. If effects are nearly collinear, each is far more uncertain than the sum of
/// their predictions. p parameters fitted to rows of unit variance predict these rows with
/// variances that sum to p,
///   sum_k tr(J_k Sigma J_k^T) = p          [trace of the hat matrix],
/// but to more if each effect is taken by itself. Returns the ratio of the two sums, at most 1. It
/// is 1 for ranges, because errors that cancel along the wire need not cancel across it. The factor
/// is an average over the fitted rows: it says nothing about any single pose.
/// @param discrepancy_parameters  effective parameters of the written discrepancy model, whose
///                                covariances are already scaled this way; 0 if there is none
double CovarianceShare(const Identified& found, double discrepancy_parameters);

}  // namespace plumbline::measure
