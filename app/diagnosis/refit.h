// Parameters of chosen effects, and the free frames, by nonlinear least squares.
#pragma once

#include "app/diagnosis/fit_problem.h"
#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// A model whose parameters were adjusted: all numbers of its effects but the moment of a step,
/// cycles a turn that are whole, and the curve of an empirical term.
struct Refit {
  Model model;
  Eigen::MatrixXd covariance;  ///< of the adjusted parameters, SI, frames marginalised
  std::vector<bool> held;  ///< of each: false where the rows leave it free, whatever `covariance`
  std::vector<std::pair<int, int>> parameters;  ///< (effect, parameter) of each row of `covariance`
  double chi2 = 0;                              ///< weighted, in sigma
};

struct RefitOptions {
  int iterations = 8;
  bool frames_only = false;  ///< effects stay as they are
};

/// Minimises sum_k w_k r_k^T C_k^-1 r_k / sigma^2, r_k a row's residuals and C_k their covariance
/// (RowNumbers), over effects and free frames by
/// Levenberg-Marquardt (Ceres) with analytic derivatives, from the given model.
Result<Refit> RefitModel(const FitProblem& problem, const Model& start,
                         const RefitOptions& options);

}  // namespace plumbline
