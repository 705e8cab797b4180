#include "app/measure/diagnosis/linear/refit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>

namespace plumbline::measure {
namespace {

/// Maximum number of rows whose gradients are cached between iterations; more would need too much
/// memory.
constexpr int kMaxCachedRows = 20000;

bool IsAdjusted(const effects::ActiveEffect& effect, std::size_t k) {
  if (effect.term.effect->traits().empirical) return false;
  const effects::ParameterSpec& spec =
      effect.term.effect->traits().parameters[effect.term.parameters[k].spec];
  if (spec.role != effects::ParameterRole::kShape) return true;
  if (effects::IsEventTime(spec)) return false;
  if (spec.unit != "1/turn") return true;
  // Whole cycles are not adjusted: an eccentricity has one cycle, an ellipticity two. With many
  // lines, no cycles are adjusted after the search, since the joint problem has too many minima.
  constexpr int kFewLines = 4;
  int lines = 0;
  const auto& specs = effect.term.effect->traits().parameters;
  for (const effects::TermParameter& parameter : effect.term.parameters)
    lines += specs[parameter.spec].unit == "1/turn" ? 1 : 0;
  return lines <= kFewLines && effect.values[k] != std::round(effect.values[k]);
}

}  // namespace

RefitLayout RefitLayoutOf(const Dataset& data, const Model& model, bool frames_only) {
  RefitLayout layout(data);
  for (std::size_t e = 0; e < model.effects.size() && !frames_only; ++e) {
    for (std::size_t k = 0; k < model.effects[e].values.size(); ++k) {
      if (!IsAdjusted(model.effects[e], k)) continue;
      layout.parameters.emplace_back(static_cast<int>(e), static_cast<int>(k));
      const double value = std::abs(model.effects[e].values[k]);
      layout.unit.push_back(value > 0 ? value : 1e-6);
    }
  }
  return layout;
}

Model Moved(const RefitLayout& layout, const Model& start, const double* x) {
  Model model = start;
  layout.nuisances.MoveSessions(x, model);
  int at = layout.nuisances.of_sessions();
  for (std::size_t j = 0; j < layout.parameters.size(); ++j) {
    const auto [effect, parameter] = layout.parameters[j];
    model.effects[effect].values[parameter] += layout.unit[j] * x[at++];
  }
  return model;
}

RowsCost::RowsCost(const FitProblem& problem, const Model& start, const RefitLayout& layout,
                   const Whitener& whitener, std::vector<FitRowIndex> rows,
                   std::optional<ComponentIndex> component, const LinearProblem* first_order)
    : problem_(problem),
      data_(problem.data),
      start_(start),
      layout_(layout),
      whitener_(whitener),
      rows_(std::move(rows)),
      component_(component),
      first_order_(first_order),
      common_(layout.size()),
      threads_(problem.threads) {
  for (const FitRowIndex j : rows_) residuals_.Add(data_.numbers[problem_.rows[j]].count);
  if (component_) {
    groups_ = layout_.nuisances.GroupsOf(*component_);
    for (const GroupIndex group : groups_) own_ += layout_.nuisances.CountOf(group);
    residuals_.Add(static_cast<int>(layout_.nuisances.EquationsAt(start_, *component_).size()));
  }
  set_num_residuals(residuals_.total());
  for (const int size : {common_, own_}) {
    if (size > 0) mutable_parameter_block_sizes()->push_back(size);
  }
}

void RowsCost::MoveOwn(const double* x, Model& model) const {
  for (const GroupIndex group : groups_) {
    layout_.nuisances.MoveGroup(group, x, model);
    x += layout_.nuisances.CountOf(group);
  }
}

bool RowsCost::Evaluate(double const* const* x, double* residuals, double** jacobians) const {
  Model model = common_ > 0 ? Moved(layout_, start_, x[0]) : start_;
  if (own_ > 0) MoveOwn(x[common_ > 0 ? 1 : 0], model);
  Rows none(0, 0);
  double* of_common = jacobians != nullptr && common_ > 0 ? jacobians[0] : nullptr;
  double* of_places = jacobians != nullptr && own_ > 0 ? jacobians[common_ > 0 ? 1 : 0] : nullptr;
  const bool wanted = of_common != nullptr;
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  Eigen::Map<Rows> J(wanted ? of_common : none.data(), wanted ? num_residuals() : 0,
                     wanted ? common_ : 0);
  Eigen::Map<Rows> places(of_places != nullptr ? of_places : none.data(),
                          of_places != nullptr ? num_residuals() : 0,
                          of_places != nullptr ? own_ : 0);
  J.setZero();
  places.setZero();
  const bool exact = first_order_ == nullptr;
  if (wanted && exact && cached_.empty() && problem_.rows.count() <= kMaxCachedRows) {
    cached_.resize(rows_.size());
  }
  std::optional<ModelAtRows> at_rows;
  if (exact) at_rows.emplace(data_, model);
  std::atomic<bool> converged{true};
  InParallel(static_cast<int>(rows_.size()), threads_, [&](int first, int last) {
    deflection::Sensitivity scratch;
    LinearRow exact_at;
    Gradient gradient;
    std::vector<TermSlope> slopes;
    for (const FitRowIndex k : IndexRange(FitRowIndex(first), FitRowIndex(last))) {
      const RowIndex row = problem_.rows[rows_[k.offset()]];
      const RowWhitening& whitening = whitener_[rows_[k.offset()]];
      slopes.clear();
      if (wanted) AddSlopes(model, row, slopes);
      if (exact) {
        deflection::InfluenceSet touched;
        for (const TermSlope& slope : slopes) touched.set(static_cast<std::size_t>(slope.entry));
        const bool cached = wanted && IsCached(k, touched);
        if (!at_rows->At(row, cached ? deflection::InfluenceSet() : touched, scratch, exact_at,
                         gradient)) {
          converged = false;
          return;
        }
        if (wanted) CacheOrRestore(k, touched, cached, gradient);
      }
      const LinearRow& at = exact ? exact_at : first_order_->linear().rows[row];
      const Gradient& of_row = exact ? gradient : first_order_->linear().gradients[row];
      whitening.Apply(exact ? exact_at.residual : FirstOrderResidual(model, row, x),
                      residuals_.PartOf(r, k));
      if (of_places != nullptr) FillOwn(row, at, whitening, residuals_.PartOf(places, k));
      if (!wanted) continue;
      auto block = residuals_.PartOf(J, k);
      FillFrames(row, at, whitening, block);
      const int first_size = layout_.nuisances.of_sessions();
      for (const TermSlope& term : slopes) {
        const double unit = layout_.unit[term.column];
        whitening.Times(unit).Add(-term.slope, of_row.col(term.entry),
                                  block.col(first_size + term.column));
      }
    }
  });
  if (component_) AddEquations(model, r, places);
  return converged;
}

bool RowsCost::IsCached(FitRowIndex j, const deflection::InfluenceSet& touched) const {
  return !cached_.empty() && touched.any() && (touched & ~cached_[j].entries).none();
}

void RowsCost::CacheOrRestore(FitRowIndex j, const deflection::InfluenceSet& touched, bool cached,
                              Gradient& gradient) const {
  if (cached_.empty()) return;
  CachedGradient& of_row = cached_[j];
  if (cached) {
    gradient.resize(of_row.columns.rows(), Gradient::ColsAtCompileTime);
  } else {
    of_row.entries = touched;
    of_row.columns.resize(gradient.rows(), static_cast<Eigen::Index>(touched.count()));
  }
  Eigen::Index place = 0;
  for (int entry = 0; entry < Gradient::ColsAtCompileTime; ++entry) {
    if (!of_row.entries.test(static_cast<std::size_t>(entry))) continue;
    if (cached) {
      gradient.col(entry) = of_row.columns.col(place++);
    } else {
      of_row.columns.col(place++) = gradient.col(entry);
    }
  }
}

template <typename BlockRows>
void RowsCost::FillFrames(RowIndex row, const LinearRow& at, const RowWhitening& whitening,
                          BlockRows& block) const {
  const FrameGradient negative = -at.frames;
  layout_.nuisances.ForEachFrameBlock(negative, row, [&](const auto& derivative, int first) {
    whitening.Apply(derivative, block.middleCols(first, derivative.cols()));
  });
}

RowResidual RowsCost::FirstOrderResidual(const Model& model, RowIndex row,
                                         double const* const* x) const {
  const Nuisances& nuisances = layout_.nuisances;
  const LinearRow& at = first_order_->linear().rows[row];
  RowResidual residual = first_order_->without_effects()[row] -
                         DisplacementBy(model.effects, data_, first_order_->linear(), row);
  if (common_ > 0) {
    RowResidual change = RowResidual::Zero(residual.size());
    nuisances.AddFrames(at, row, x[0], change);
    residual -= change;
  }
  if (own_ > 0) {
    const double* step = x[common_ > 0 ? 1 : 0] + PlaceOf(nuisances.GroupOf(row).value());
    residual -= at.own * Eigen::Map<const Eigen::VectorXd>(step, at.own.cols());
  }
  return residual;
}

int RowsCost::PlaceOf(GroupIndex group) const {
  int place = 0;
  for (const GroupIndex other : groups_) {
    if (other == group) break;
    place += layout_.nuisances.CountOf(other);
  }
  return place;
}

template <typename BlockRows>
void RowsCost::FillOwn(RowIndex row, const LinearRow& at, const RowWhitening& whitening,
                       BlockRows block) const {
  const GroupIndex group = layout_.nuisances.GroupOf(row).value();
  const Eigen::MatrixXd negative = -at.own;
  whitening.Apply(negative, block.middleCols(PlaceOf(group), negative.cols()));
}

void RowsCost::AddEquations(const Model& model, Eigen::Map<Eigen::VectorXd>& r,
                            Eigen::Map<Rows>& places) const {
  int at = residuals_.first(FitRowIndex(rows_.size()));
  for (const Equation& equation : layout_.nuisances.EquationsAt(model, *component_)) {
    r[at] = equation.residual;
    for (const auto& [nuisance, slope] : equation.slopes) {
      if (places.rows() == 0) break;
      for (const GroupIndex group : groups_) {
        const int within = nuisance - layout_.nuisances.FirstOf(group);
        if (within < 0 || within >= layout_.nuisances.CountOf(group)) continue;
        places(at, PlaceOf(group) + within) = -slope;
      }
    }
    ++at;
  }
}

void RowsCost::AddSlopes(const Model& model, RowIndex row, std::vector<TermSlope>& slopes) const {
  for (std::size_t e = 0; e < model.effects.size(); ++e) {
    std::vector<int> which, columns;
    for (std::size_t j = 0; j < layout_.parameters.size(); ++j) {
      if (layout_.parameters[j].first != static_cast<int>(e)) continue;
      which.push_back(layout_.parameters[j].second);
      columns.push_back(static_cast<int>(j));
    }
    if (which.empty()) continue;
    const std::size_t own = slopes.size();
    AddTermSlopes(model.effects[e].term, model.effects[e].values, which, data_.conditions[row],
                  slopes);
    for (std::size_t k = own; k < slopes.size(); ++k) {
      slopes[k].column = columns[slopes[k].column];
    }
  }
}

std::vector<std::unique_ptr<RowsCost>> CostsOf(const FitProblem& problem, const Model& start,
                                               const RefitLayout& layout, const Whitener& whitener,
                                               const LinearProblem* first_order) {
  const auto components = static_cast<std::size_t>(layout.nuisances.components());
  std::vector<std::vector<FitRowIndex>> rows(components + 1);
  for (const FitRowIndex j : problem.rows.indices()) {
    const auto group = layout.nuisances.GroupOf(problem.rows[j]);
    rows[group ? layout.nuisances.ComponentOf(*group).offset() : components].push_back(j);
  }
  std::vector<std::unique_ptr<RowsCost>> costs;
  for (std::size_t c = 0; c <= components; ++c) {
    if (rows[c].empty()) continue;
    costs.push_back(std::make_unique<RowsCost>(
        problem, start, layout, whitener, std::move(rows[c]),
        c < components ? std::optional(ComponentIndex(c)) : std::nullopt, first_order));
  }
  return costs;
}

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
      CostsOf(problem, start, layout, whitener, options.first_order);
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
