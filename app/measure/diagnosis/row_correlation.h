// Correlation of the noise of successive rows, and the variance inflation that it causes.
#pragma once

#include "app/measure/diagnosis/linear_problem.h"

namespace plumbline::measure {

/// Lag-1 autocorrelation of the residuals, pooled over all axes and sessions, 0..0.95; 0 unless
/// significant at the 0.1 % level. Pairs within one cluster are ignored, since both rows share the
/// model error at their pose, and so are pairs with a rejected row.
double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights);

/// Factor by which AR(1) noise with the fit's row correlation rho increases the variance of a
/// column's coefficient over independent noise:
///   sum_ij rho^|i-j| x_i . x_j / sum_i x_i . x_i,   i and j in one session; at least 1.
/// About (1 + rho) / (1 - rho) for a step, and 1 for a column in random order.
/// @param column  whitened and projected, shape (residuals)
double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column);

}  // namespace plumbline::measure
