// Group-wise ridge regression with variances estimated by marginal likelihood (REML).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline::measure {

/// Sufficient statistics of a least squares problem with whitened columns X and response y.
struct NormalEquations {
  Eigen::MatrixXd gram;    ///< X^T X, shape (columns, columns)
  Eigen::VectorXd moment;  ///< X^T y
  double square = 0;       ///< y^T y
  double freedom = 0;      ///< size of y less the number of directions projected out
  /// Upper limit of the prior variance of each coefficient; the smallest limit of its columns
  /// applies to a group. Empty if there are no limits.
  Eigen::VectorXd most_variance{};
};

/// Result of a fit with shrinkage.
struct ShrunkenFit {
  Eigen::VectorXd values;                ///< posterior means of the coefficients
  Eigen::MatrixXd covariance;            ///< posterior covariance; empty unless requested
  Eigen::VectorXd ratio;                 ///< of each group: prior variance over noise variance
  Eigen::VectorXd effective_parameters;  ///< of each group
  double noise = 1;                      ///< variance of the noise of y
  double gain = 0;  ///< 2 ln(marginal likelihood) relative to the model without columns
};

/// Fits y = sum_g X_g w_g + e with w_g ~ N(0, v_g I) and e ~ N(0, s^2 I); v_g and s^2 maximise the
/// marginal likelihood, which is the restricted one (REML) if nuisance directions were projected
/// out of X and y.
///   A = I + R^1/2 X^T X R^1/2, R = diag(v_g / s^2);  w = R^1/2 A^-1 R^1/2 X^T y
///   2 ln L = -ln|A| - n ln(y^T y - w^T X^T y)
/// Fixed-point iteration v_g = |w_g|^2 / p_g within its limit, p_g the effective number of
/// parameters. [MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447; Harville, J.
/// Am. Stat. Assoc. 72 (1977) 320-338]
/// @param group            of each column, 0-based and without gaps
/// @param start            initial ratios (from a fit of similar data), or empty
/// @param with_covariance  whether to compute the posterior covariance
ShrunkenFit Shrink(const NormalEquations& equations, const std::vector<int>& group,
                   const Eigen::VectorXd& start, bool with_covariance);

}  // namespace plumbline::measure
