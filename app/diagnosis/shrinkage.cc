#include "app/diagnosis/shrinkage.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace plumbline {
namespace {

constexpr int kMostSteps = 60;
constexpr double kSettled = 0.05;    // change of 2 ln L
constexpr double kLeastHeld = 1e-3;  // parameters; a group below it is nothing

/// Ratios at which every group brings a tenth of y's square.
Eigen::VectorXd FirstRatios(const NormalEquations& equations, const std::vector<int>& group,
                            int groups) {
  Eigen::VectorXd trace = Eigen::VectorXd::Zero(groups);
  for (std::size_t k = 0; k < group.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    trace[group[k]] += equations.gram(at, at);
  }
  return trace.unaryExpr([&](double sum) { return sum > 0 ? 0.1 * equations.freedom / sum : 0; });
}

/// Largest ratio of each group.
Eigen::VectorXd MostRatios(const NormalEquations& equations, const std::vector<int>& group,
                           int groups, double noise) {
  Eigen::VectorXd most = Eigen::VectorXd::Constant(groups, HUGE_VAL);
  if (equations.most_variance.size() == 0) return most;
  for (std::size_t k = 0; k < group.size(); ++k) {
    double& of_group = most[group[k]];
    of_group = std::min(of_group, equations.most_variance[static_cast<Eigen::Index>(k)] / noise);
  }
  return most;
}

}  // namespace

ShrunkenFit Shrink(const NormalEquations& equations, const std::vector<int>& group,
                   const Eigen::VectorXd& start, bool with_covariance) {
  const auto n = static_cast<Eigen::Index>(group.size());
  const int groups = n > 0 ? *std::max_element(group.begin(), group.end()) + 1 : 0;
  ShrunkenFit fit;
  fit.values = Eigen::VectorXd::Zero(n);
  fit.ratio = start.size() == groups ? start : FirstRatios(equations, group, groups);
  fit.held = Eigen::VectorXd::Zero(groups);
  fit.noise = equations.square / std::max(1.0, equations.freedom);
  if (fit.noise > 0)
    fit.ratio = fit.ratio.cwiseMin(MostRatios(equations, group, groups, fit.noise));
  if (n == 0 || equations.square <= 0) return fit;
  double before = -1e300;
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::VectorXd root(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      root[k] = std::sqrt(fit.ratio[group[static_cast<std::size_t>(k)]]);
    }
    Eigen::MatrixXd A = root.asDiagonal() * equations.gram * root.asDiagonal();
    A.diagonal().array() += 1;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(A);
    fit.values = root.cwiseProduct(cholesky.solve(root.cwiseProduct(equations.moment)));
    // The square that is left, penalty included; rounding must not make it nothing.
    const double left =
        std::max(equations.square - fit.values.dot(equations.moment), 1e-12 * equations.square);
    fit.noise = left / equations.freedom;
    const Eigen::MatrixXd L = cholesky.matrixL();
    fit.gain = equations.freedom * std::log(equations.square / left) -
               2 * L.diagonal().array().log().sum();
    const Eigen::MatrixXd inverse =
        cholesky.matrixL().solve(Eigen::MatrixXd::Identity(n, n));  // of L
    Eigen::VectorXd square = Eigen::VectorXd::Zero(groups);
    fit.held.setZero();
    for (Eigen::Index k = 0; k < n; ++k) {
      const int g = group[static_cast<std::size_t>(k)];
      fit.held[g] += 1 - inverse.col(k).tail(n - k).squaredNorm();
      square[g] += fit.values[k] * fit.values[k];
    }
    const bool settled = std::abs(fit.gain - before) < kSettled;
    if (settled || step + 1 == kMostSteps) {
      if (with_covariance) {
        const Eigen::MatrixXd scaled = inverse * root.asDiagonal();
        fit.covariance.noalias() = fit.noise * (scaled.transpose() * scaled);
      }
      break;
    }
    before = fit.gain;
    const Eigen::VectorXd most = MostRatios(equations, group, groups, fit.noise);
    for (int g = 0; g < groups; ++g) {
      fit.ratio[g] =
          fit.held[g] > kLeastHeld ? std::min(most[g], square[g] / (fit.held[g] * fit.noise)) : 0;
    }
  }
  return fit;
}

}  // namespace plumbline
