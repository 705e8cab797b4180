#include "app/measure/diagnosis/refit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <memory>
#include <optional>

#include "app/measure/diagnosis/rows_cost.h"

namespace plumbline::measure {
namespace {

/// Range of an adjusted parameter, SI: the search range for shapes; nullopt (unbounded) for sizes
/// and for angles, which are periodic.
std::optional<model::Interval> RangeOf(const effects::ActiveEffect& effect, std::size_t k) {
  const effects::ParameterSpec& spec =
      effect.term.effect->traits().parameters[effect.term.parameters[k].spec];
  if (spec.role != effects::ParameterRole::kShape || spec.unit == "rad") return std::nullopt;
  return model::Interval{spec.plausible.low * spec.to_SI, spec.plausible.high * spec.to_SI};
}

/// Sets the ranges as bounds of the solver's variables, and a start within them.
void SetBounds(const RefitLayout& layout, const Model& start, std::vector<double>& x,
               ceres::Problem& problem) {
  const std::size_t first = x.size() - layout.parameters.size();
  for (std::size_t j = 0; j < layout.parameters.size(); ++j) {
    const auto effect = static_cast<std::size_t>(layout.parameters[j].first);
    const auto value = static_cast<std::size_t>(layout.parameters[j].second);
    const std::optional<model::Interval> range = RangeOf(start.effects[effect], value);
    if (!range) continue;
    const double at = start.effects[effect].values[value];
    const double low = (range->low - at) / layout.unit[j];
    const double high = (range->high - at) / layout.unit[j];
    const auto place = static_cast<int>(first + j);
    problem.SetParameterLowerBound(x.data(), place, low);
    problem.SetParameterUpperBound(x.data(), place, high);
    x[first + j] = std::clamp(0.0, low, high);
  }
}

/// Pseudoinverse of a scaled information matrix, restricted to the directions that the rows
/// determine.
struct Inverse {
  Eigen::MatrixXd matrix;
  std::vector<bool>
      identifiable;  ///< false for a parameter with a component along an undetermined direction
};

Inverse InverseOfDetermined(const Eigen::MatrixXd& information) {
  constexpr double kMinEigenvalue = 1e-10;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information);
  const double least = kMinEigenvalue * std::max(1e-300, solver.eigenvalues().maxCoeff());
  const Eigen::VectorXd inverse = solver.eigenvalues().unaryExpr(
      [least](double value) { return value > least ? 1 / value : 0.0; });
  Inverse result;
  result.matrix = solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
  result.identifiable.assign(information.rows(), true);
  for (Eigen::Index k = 0; k < inverse.size(); ++k) {
    if (inverse[k] > 0) continue;
    // The variance that the direction would contribute if its eigenvalue were just at the limit.
    for (Eigen::Index i = 0; i < information.rows(); ++i) {
      const double part = solver.eigenvectors()(i, k);
      if (part * part / least > result.matrix(i, i)) {
        result.identifiable[i] = false;
      }
    }
  }
  return result;
}

/// The solver's variables, and the costs that depend on them.
struct Variables {
  std::vector<double> common;
  std::vector<std::vector<double>> own;  ///< of each cost

  /// The variables of a cost, as ceres passes them.
  std::vector<double*> Of(std::size_t cost) {
    std::vector<double*> blocks;
    if (!common.empty()) blocks.push_back(common.data());
    if (!own[cost].empty()) blocks.push_back(own[cost].data());
    return blocks;
  }
};

/// Minimises the costs; the owner keeps them.
/// @return  an error if the solver fails
Result<void> Minimise(const RefitLayout& layout, const Model& start,
                      const std::vector<std::unique_ptr<RowsCost>>& costs,
                      const RefitOptions& options, int threads, Variables& x) {
  ceres::Problem::Options keep;
  keep.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem solved(keep);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  bool places = false;
  for (std::size_t c = 0; c < costs.size(); ++c) {
    const std::vector<double*> blocks = x.Of(c);
    if (blocks.empty()) continue;
    solved.AddResidualBlock(costs[c].get(), nullptr, blocks);
    if (x.own[c].empty()) continue;
    ordering->AddElementToGroup(x.own[c].data(), 0);
    places = true;
  }
  if (!x.common.empty()) {
    ordering->AddElementToGroup(x.common.data(), 1);
    SetBounds(layout, start, x.common, solved);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  if (places) {
    // The places of one component are eliminated by themselves.
    solver.linear_solver_type =
        x.common.empty() ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = ordering;
    solver.num_threads = threads;
    for (const auto& cost : costs) cost->UseThreads(1);
  }
  // Steps are clamped to the bounds. Ceres would also search along every step of a bounded problem,
  // which takes most of the time and changes nothing where the whole step is accepted.
  solver.max_num_line_search_step_size_iterations = 0;
  solver.max_num_iterations = options.iterations;
  solver.logging_type = ceres::SILENT;
  solver.function_tolerance = 1e-8;
  solver.parameter_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &solved, &summary);
  if (!summary.IsSolutionUsable()) return Error{"the refit did not converge: " + summary.message};
  return {};
}

/// Sum of squares at the solution, and the information of frames and parameters with the other
/// nuisances eliminated.
struct AtSolution {
  double chi2 = 0;
  Eigen::MatrixXd information;
};

std::optional<AtSolution> EvaluatedAt(const std::vector<std::unique_ptr<RowsCost>>& costs,
                                      int threads, Variables& x) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto common = static_cast<Eigen::Index>(x.common.size());
  AtSolution at;
  at.information = Eigen::MatrixXd::Zero(common, common);
  Eigen::RowVectorXd raw = Eigen::RowVectorXd::Zero(common);  // before the elimination
  for (std::size_t c = 0; c < costs.size(); ++c) {
    Eigen::VectorXd residuals(costs[c]->num_residuals());
    Rows J(residuals.size(), common), places(residuals.size(), costs[c]->own());
    const double none = 0;
    std::vector<double*> blocks = x.Of(c);
    std::vector<const double*> where(blocks.begin(), blocks.end());
    if (where.empty()) where.push_back(&none);
    std::vector<double*> jacobians;
    if (common > 0) jacobians.push_back(J.data());
    if (places.cols() > 0) jacobians.push_back(places.data());
    costs[c]->ClearGradients();
    costs[c]->UseThreads(threads);
    if (!costs[c]->Evaluate(where.data(), residuals.data(),
                            jacobians.empty() ? nullptr : jacobians.data())) {
      return std::nullopt;
    }
    at.chi2 += residuals.squaredNorm();
    if (common == 0) continue;
    raw += J.colwise().squaredNorm();
    if (places.cols() > 0) {
      const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(places);
      const Eigen::MatrixXd basis =
          qr.householderQ() * Eigen::MatrixXd::Identity(places.rows(), qr.rank());
      J -= basis * (basis.transpose() * J).eval();
    }
    at.information.noalias() += J.transpose() * J;
  }
  // What the places leave of such a column is rounding, not information.
  constexpr double kRounding = 1e-12;
  for (Eigen::Index i = 0; i < common; ++i) {
    if (at.information(i, i) > kRounding * raw[i]) continue;
    at.information.row(i).setZero();
    at.information.col(i).setZero();
  }
  return at;
}

}  // namespace

Result<Refit> RefitModel(const FitProblem& problem, const Model& start,
                         const RefitOptions& options) {
  const RefitLayout layout = RefitLayoutOf(problem.data, start, options.frames_only);
  const Whitener whitener(problem);
  const std::vector<std::unique_ptr<RowsCost>> costs =
      CostsOf(problem, start, layout, whitener, options.gradients);
  Refit refit;
  refit.model = start;
  refit.parameters = layout.parameters;
  Variables x;
  x.common.assign(layout.size(), 0.0);
  bool any = !x.common.empty();
  for (const auto& cost : costs) {
    x.own.emplace_back(static_cast<std::size_t>(cost->own()), 0.0);
    any = any || cost->own() > 0;
  }
  if (any) {
    const Result<void> solved = Minimise(layout, start, costs, options, problem.threads, x);
    if (!solved) return solved.failure();
    refit.model = Moved(layout, start, x.common.data());
    for (std::size_t c = 0; c < costs.size(); ++c) costs[c]->MoveOwn(x.own[c].data(), refit.model);
  }
  const std::optional<AtSolution> at = EvaluatedAt(costs, problem.threads, x);
  if (!at) return Error{"the deflected posture does not converge"};
  refit.chi2 = at->chi2;
  const auto count = static_cast<int>(layout.parameters.size());
  if (count == 0) return refit;
  // Scaled to a unit diagonal before inversion, since the parameters differ by many orders of
  // magnitude.
  const Eigen::MatrixXd& information = at->information;
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Inverse inverse = InverseOfDetermined(scaled);
  const Eigen::MatrixXd all = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();
  refit.covariance.resize(count, count);
  const int first = layout.size() - count;
  refit.identifiable.assign(inverse.identifiable.begin() + first, inverse.identifiable.end());
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      refit.covariance(i, j) = all(first + i, first + j) * layout.unit[i] * layout.unit[j];
    }
  }
  return refit;
}

}  // namespace plumbline::measure
