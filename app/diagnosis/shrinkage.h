// Many columns in few groups, each group shrunk as far as the data say.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline {

/// Least squares in numbers that suffice: of whitened columns X and response y.
struct NormalEquations {
  Eigen::MatrixXd gram;    ///< X^T X, shape (columns, columns)
  Eigen::VectorXd moment;  ///< X^T y
  double square = 0;       ///< y^T y
  double freedom = 0;      ///< numbers in y, less the directions projected out
  /// Largest prior variance of each column's coefficient; a group has the least of its columns'.
  /// Empty: any.
  Eigen::VectorXd most_variance{};
};

/// What a fit with shrinkage found.
struct ShrunkenFit {
  Eigen::VectorXd values;      ///< posterior means of the columns' coefficients
  Eigen::MatrixXd covariance;  ///< posterior; filled where asked for
  Eigen::VectorXd ratio;       ///< of each group: prior variance over the noise's
  Eigen::VectorXd held;        ///< of each group: parameters that the data hold, of its columns
  double noise = 1;            ///< variance of y beside the columns
  double gain = 0;             ///< 2 ln of the marginal likelihood, above that of no column at all
};

/// y = sum_g X_g w_g + e with w_g ~ N(0, v_g I) and e ~ N(0, s^2 I), v_g and s^2 by maximal
/// marginal likelihood; restricted (REML) where nuisances are projected out of X and y before.
///   A = I + R^1/2 X^T X R^1/2, R = diag(v_g / s^2);  w = R^1/2 A^-1 R^1/2 X^T y
///   2 ln L = -ln|A| - n ln(y^T y - w^T X^T y),  fixed point v_g = |w_g|^2 / held_g, up to its most
/// [MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447; Harville, J. Am. Stat.
/// Assoc. 72 (1977) 320-338]
/// @param group   of each column, 0-based and without gaps
/// @param start   ratios to start from (a fit of nearly the same data), or empty
ShrunkenFit Shrink(const NormalEquations& equations, const std::vector<int>& group,
                   const Eigen::VectorXd& start, bool with_covariance);

}  // namespace plumbline
