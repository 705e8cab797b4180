#include "app/measure/diagnosis/shrinkage.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace plumbline::measure {
namespace {

constexpr int kMaxSteps = 60;
constexpr double kConverged = 0.05;  // change of 2 ln L
constexpr double kMinEffectiveParameters =
    1e-3;  // below it, the variance of a group is set to zero

/// Initial ratios, at which every group contributes a tenth of the square of y.
Eigen::VectorXd InitialRatios(const NormalEquations& equations, const std::vector<int>& group,
                              int groups) {
  Eigen::VectorXd trace = Eigen::VectorXd::Zero(groups);
  for (std::size_t k = 0; k < group.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    trace[group[k]] += equations.gram(at, at);
  }
  return trace.unaryExpr([&](double sum) { return sum > 0 ? 0.1 * equations.freedom / sum : 0; });
}

/// Upper limit of the ratio of each group.
Eigen::VectorXd RatioLimits(const NormalEquations& equations, const std::vector<int>& group,
                            int groups, double noise) {
  Eigen::VectorXd most = Eigen::VectorXd::Constant(groups, HUGE_VAL);
  if (equations.most_variance.size() == 0) return most;
  for (std::size_t k = 0; k < group.size(); ++k) {
    double& of_group = most[group[k]];
    of_group = std::min(of_group, equations.most_variance[static_cast<Eigen::Index>(k)] / noise);
  }
  return most;
}

/// Inverts a lower triangular matrix in place; its upper part is zero and stays so. By halves, a
/// third of the operations of solving for the identity.
void InvertLower(Eigen::Ref<Eigen::MatrixXd> L) {
  constexpr Eigen::Index kSmall = 32;
  const Eigen::Index n = L.rows(), half = n / 2, rest = n - half;
  if (n <= kSmall) {
    L = L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(n, n)).eval();
    return;
  }
  InvertLower(L.topLeftCorner(half, half));
  InvertLower(L.bottomRightCorner(rest, rest));
  const Eigen::MatrixXd left = L.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>() *
                               L.bottomLeftCorner(rest, half);
  L.bottomLeftCorner(rest, half).noalias() =
      -(left * L.topLeftCorner(half, half).triangularView<Eigen::Lower>());
}

}  // namespace

ShrunkenFit Shrink(const NormalEquations& equations, const std::vector<int>& group,
                   const Eigen::VectorXd& start, bool with_covariance) {
  const auto n = static_cast<Eigen::Index>(group.size());
  const int groups = n > 0 ? *std::ranges::max_element(group) + 1 : 0;
  ShrunkenFit fit;
  fit.values = Eigen::VectorXd::Zero(n);
  fit.ratio = start.size() == groups ? start : InitialRatios(equations, group, groups);
  fit.effective_parameters = Eigen::VectorXd::Zero(groups);
  fit.noise = equations.square / std::max(1.0, equations.freedom);
  if (fit.noise > 0)
    fit.ratio = fit.ratio.cwiseMin(RatioLimits(equations, group, groups, fit.noise));
  if (n == 0 || equations.square <= 0) return fit;
  double previous_gain = -1e300;
  for (int step = 0; step < kMaxSteps; ++step) {
    // Columns of groups whose variance is zero are zero; they are left out.
    std::vector<Eigen::Index> active;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (fit.ratio[group[k]] > 0) active.push_back(k);
    }
    const auto count = static_cast<Eigen::Index>(active.size());
    Eigen::VectorXd root(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      root[k] = std::sqrt(fit.ratio[group[active[k]]]);
    }
    Eigen::MatrixXd A = root.asDiagonal() * equations.gram(active, active) * root.asDiagonal();
    A.diagonal().array() += 1;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(A);
    const Eigen::VectorXd moment = equations.moment(active);
    fit.values.setZero();
    fit.values(active) = root.cwiseProduct(cholesky.solve(root.cwiseProduct(moment)));
    // Residual sum of squares including the penalty; kept positive despite rounding.
    const double residual =
        std::max(equations.square - fit.values.dot(equations.moment), 1e-12 * equations.square);
    fit.noise = residual / equations.freedom;
    Eigen::MatrixXd inverse = cholesky.matrixL();  // becomes that of L
    fit.gain = equations.freedom * std::log(equations.square / residual) -
               2 * inverse.diagonal().array().log().sum();
    InvertLower(inverse);
    Eigen::VectorXd square = Eigen::VectorXd::Zero(groups);
    fit.effective_parameters.setZero();
    for (Eigen::Index k = 0; k < count; ++k) {
      const int g = group[active[k]];
      fit.effective_parameters[g] += 1 - inverse.col(k).tail(count - k).squaredNorm();
      const double value = fit.values[active[k]];
      square[g] += value * value;
    }
    const bool converged = std::abs(fit.gain - previous_gain) < kConverged;
    if (converged || step + 1 == kMaxSteps) {
      if (with_covariance) {
        const Eigen::MatrixXd scaled = inverse * root.asDiagonal();
        fit.covariance = Eigen::MatrixXd::Zero(n, n);
        fit.covariance(active, active) = fit.noise * (scaled.transpose() * scaled);
      }
      break;
    }
    previous_gain = fit.gain;
    const Eigen::VectorXd most = RatioLimits(equations, group, groups, fit.noise);
    for (int g = 0; g < groups; ++g) {
      fit.ratio[g] = fit.effective_parameters[g] > kMinEffectiveParameters
                         ? std::min(most[g], square[g] / (fit.effective_parameters[g] * fit.noise))
                         : 0;
    }
  }
  return fit;
}

}  // namespace plumbline::measure
