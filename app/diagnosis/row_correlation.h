// Noise that goes on from one row to the next, and what it costs an effect that does so, too.
#pragma once

#include "app/diagnosis/linear_problem.h"

namespace plumbline {

/// Correlation of successive rows' residuals over all axes and sessions, 0..0.95: 0 where
/// independent noise would show as much more than once in a thousand data sets. Rows of one
/// cluster do not count, since they share what the model lacks at their pose; rejected rows
/// neither.
double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights);

/// Times by which noise of the fit's row correlation rho raises the variance of a column's value
/// above that under independent noise, with noise AR(1) from row to row:
///   sum_ij rho^|i-j| x_i . x_j / sum_i x_i . x_i,   i and j in one session; at least 1.
/// For a step this is near (1 + rho) / (1 - rho), for a column without order 1.
/// @param column  whitened and projected, shape (residuals)
double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column);

}  // namespace plumbline
