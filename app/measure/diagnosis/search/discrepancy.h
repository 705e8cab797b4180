// Discrepancy model: a shrunken fit of the residual that the named effects leave. It corrects
// within the measured range and explains nothing.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/search.h"

namespace plumbline::measure {

// Group-wise ridge regression with variances estimated by marginal likelihood (REML).

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

/// One column of a curve: an entry of the influence times sin or cos(cycles q) of its joint, or
/// times a Legendre polynomial of a signal.
struct CurveTerm {
  int entry = 0;       ///< carrier: entry of the influence
  SignalIndex signal;  ///< argument of the curve
  int degree = 0;      ///< of the polynomial; 0: periodic
  double cycles = 0;
  bool cosine = false;
  double value = 0;  ///< SI
};

/// Fitted sizes of all catalogue blocks and curves, except named blocks that are exempt
/// (`IsExemptFromShrinkage`).
struct DiscrepancyModel {
  Indexed<BlockIndex, Block> blocks;  ///< catalogue blocks, linear in their sizes
  Coefficients sizes;                 ///< total sizes, including those of named effects
  std::vector<CurveTerm> curves;
  Eigen::MatrixXd covariance;                                         ///< of sizes, then curves
  std::vector<std::pair<BlockIndex, BlockColumnIndex>> size_columns;  ///< of each size
  double effective_parameters = 0;
  double gain = 0;  ///< in 2 ln(marginal likelihood) over the named effects alone
};

/// True for a named block that is exempt from shrinkage: it has shapes, or follows a signal. A
/// curve of a joint along its own angle is not exempt; the one of the discrepancy model replaces
/// it.
bool IsExemptFromShrinkage(const Block& block);

/// Fits all catalogue columns, a curve of each joint and curves along each recorded signal at once,
/// each group shrunk by marginal likelihood, frames projected out. nullopt unless its gain over the
/// named effects alone exceeds kDiscrepancyMargin after a cost of ln(1 + columns) per group.
std::optional<DiscrepancyModel> DiscrepancyModelOf(const CandidateSet& candidate_set,
                                                   const Explanation& named,
                                                   const Candidates& candidates);

/// Factor of a curve term on its carrier at a value of its signal.
double FactorAt(const Dataset& data, const CurveTerm& term, double value);

/// Name of the column of a joint angle: q3_deg.
/// @param joint  0-based
std::string AngleColumn(int joint);

/// Change of a row's prediction caused by all sizes and curves, including those of named effects.
RowResidual DisplacementBy(const DiscrepancyModel& discrepancy, const Dataset& data,
                           const Linearisation& linear, RowIndex row);

/// The effects to add to a model with the named effects so that their sum is the fitted discrepancy
/// model. Curves become `empirical` effects whose factor carries the standard deviation.
std::vector<Finding> EffectsToAdd(const DiscrepancyModel& discrepancy, const Dataset& data,
                                  const Model& named);

}  // namespace plumbline::measure
