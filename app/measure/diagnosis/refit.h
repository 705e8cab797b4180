// Nonlinear least squares fit of the parameters of selected effects and of the free frames.
#pragma once

#include "app/measure/diagnosis/fit_problem.h"
#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// A model with adjusted parameters: all values of its effects except event times, integer cycles
/// per turn and the curves of empirical terms.
struct Refit {
  Model model;
  Eigen::MatrixXd covariance;  ///< of the adjusted parameters, SI, frames marginalised
  /// For each adjusted parameter: false if the data do not identify it; its covariance is then
  /// meaningless.
  std::vector<bool> identifiable;
  std::vector<std::pair<int, int>> parameters;  ///< (effect, value) of each row of `covariance`
  double chi2 = 0;                              ///< weighted sum of squares in units of sigma
};

struct RefitOptions {
  int iterations = 8;
  bool frames_only = false;  ///< do not adjust effects
  /// d prediction / d influence of every row of the data at a model near the start, used throughout
  /// and for the covariance; if nullptr, they are computed at the start and at the solution.
  const PerRow<Gradient>* gradients = nullptr;
};

/// Minimises sum_k w_k r_k^T C_k^-1 r_k / sigma^2 over effects and free frames by
/// Levenberg-Marquardt (Ceres) with analytic derivatives, starting from the given model; r_k are
/// the residuals of a row and C_k their covariance (RowNumbers).
/// @return  an error if a deflected posture does not converge
Result<Refit> RefitModel(const FitProblem& problem, const Model& start,
                         const RefitOptions& options);

}  // namespace plumbline::measure
