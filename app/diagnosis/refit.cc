#include "app/diagnosis/refit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "app/diagnosis/whitener.h"

namespace plumbline::diagnosis {
namespace {

/// The adjusted parameters and frames, and the scales of the solver's variables.
struct Layout {
  std::vector<std::pair<int, int>> parameters;
  std::vector<double> unit;  ///< SI value of one solver unit, for each parameter
  int per_session = 0;
  bool frames = false, tip = false;
};

bool Adjusted(const effects::ActiveEffect& effect, std::size_t k) {
  if (effect.term.effect->traits().empirical) return false;
  const effects::ParameterSpec& spec =
      effect.term.effect->traits()
          .parameters[static_cast<std::size_t>(effect.term.parameters[k].spec)];
  if (spec.role != effects::ParameterRole::kShape) return true;
  if (effects::IsEventTime(spec)) return false;
  if (spec.unit != "1/turn") return true;
  // Whole cycles are not adjusted: an eccentricity has one cycle, an ellipticity two. With many
  // lines, no cycles are adjusted after the search, since the joint problem has too many minima.
  constexpr int kFewLines = 4;
  int lines = 0;
  for (const effects::TermParameter& parameter : effect.term.parameters) {
    const auto& of =
        effect.term.effect->traits().parameters[static_cast<std::size_t>(parameter.spec)];
    lines += of.unit == "1/turn" ? 1 : 0;
  }
  return lines <= kFewLines && effect.values[k] != std::round(effect.values[k]);
}

Layout LayoutOf(const Dataset& data, const Model& model, bool frames_only) {
  Layout layout;
  layout.frames = data.frames_free();
  layout.tip = data.tip_free();
  layout.per_session = (layout.frames ? 6 : 0) + (layout.tip ? 3 : 0);
  for (std::size_t e = 0; e < model.effects.size() && !frames_only; ++e) {
    for (std::size_t k = 0; k < model.effects[e].values.size(); ++k) {
      if (!Adjusted(model.effects[e], k)) continue;
      layout.parameters.emplace_back(static_cast<int>(e), static_cast<int>(k));
      const double value = std::abs(model.effects[e].values[k]);
      layout.unit.push_back(value > 0 ? value : 1e-6);
    }
  }
  return layout;
}

/// Range of an adjusted parameter, SI: the search range for shapes; nullopt (unbounded) for sizes
/// and for angles, which are periodic.
std::optional<model::Interval> RangeOf(const effects::ActiveEffect& effect, std::size_t k) {
  const effects::ParameterSpec& spec =
      effect.term.effect->traits()
          .parameters[static_cast<std::size_t>(effect.term.parameters[k].spec)];
  if (spec.role != effects::ParameterRole::kShape || spec.unit == "rad") return std::nullopt;
  return model::Interval{spec.plausible.low * spec.to_SI, spec.plausible.high * spec.to_SI};
}

/// Sets the ranges as bounds of the solver's variables, and a start within them.
void SetBounds(const Layout& layout, const Model& start, std::vector<double>& x,
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

/// The start model moved by the solver's variables x: frames of each session first, then
/// parameters.
Model Moved(const Layout& layout, const Model& start, const double* x) {
  Model model = start;
  int at = 0;
  for (Model::Frames& frames : model.frames) {
    Eigen::Matrix<double, 9, 1> step = Eigen::Matrix<double, 9, 1>::Zero();
    if (layout.frames) {
      for (int i = 0; i < 6; ++i) step[i] = x[at++];
    }
    if (layout.tip) {
      for (int i = 0; i < 3; ++i) step[6 + i] = x[at++];
    }
    MoveFrames(frames, step);
  }
  for (std::size_t j = 0; j < layout.parameters.size(); ++j) {
    const auto [effect, parameter] = layout.parameters[j];
    model.effects[static_cast<std::size_t>(effect)].values[static_cast<std::size_t>(parameter)] +=
        layout.unit[j] * x[at++];
  }
  return model;
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
  result.identifiable.assign(static_cast<std::size_t>(information.rows()), true);
  for (Eigen::Index k = 0; k < inverse.size(); ++k) {
    if (inverse[k] > 0) continue;
    // The variance that the direction would contribute if its eigenvalue were just at the limit.
    for (Eigen::Index i = 0; i < information.rows(); ++i) {
      const double part = solver.eigenvectors()(i, k);
      if (part * part / least > result.matrix(i, i)) {
        result.identifiable[static_cast<std::size_t>(i)] = false;
      }
    }
  }
  return result;
}

/// Maximum number of rows whose gradients are cached between iterations; more would need too much
/// memory.
constexpr int kMaxCachedRows = 20000;

/// All residuals as one cost function. d prediction / d influence is computed once, at the first
/// evaluation, and reused: a refit starts close to the solution, so the posture of the arm and
/// hence these gradients change by less than a thousandth. d influence / d parameter is computed at
/// every evaluation. The approximation affects the path to the minimum, and the minimum itself by a
/// thousandth of the noise.
class AllRows final : public ceres::CostFunction {
 public:
  AllRows(const FitProblem& problem, const Model& start, const Layout& layout)
      : problem_(problem),
        data_(problem.data),
        start_(start),
        layout_(layout),
        whitener_(problem),
        residuals_(problem.layout()) {
    const int free_numbers = layout.per_session * data_.sessions_count();
    size_ = free_numbers + static_cast<int>(layout.parameters.size());
    set_num_residuals(residuals_.total());
    mutable_parameter_block_sizes()->push_back(size_);
  }
  int size() const { return size_; }

  /// Discards the cached gradients; the next evaluation recomputes them.
  void ClearGradients() { cached_.clear(); }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const Model model = Moved(layout_, start_, x[0]);
    const bool wanted = jacobians != nullptr && jacobians[0] != nullptr;
    const ModelAtRows at_rows(data_, model);
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    Rows none(0, 0);
    Eigen::Map<Rows> J(wanted ? jacobians[0] : none.data(), wanted ? num_residuals() : 0,
                       wanted ? size_ : 0);
    if (wanted) J.setZero();
    if (wanted && cached_.empty() && problem_.rows.count() <= kMaxCachedRows) {
      cached_.resize(problem_.rows.size());
    }
    std::atomic<bool> converged{true};
    InParallel(problem_.rows.count(), problem_.threads, [&](int first, int last) {
      deflection::Sensitivity scratch;
      LinearRow at;
      Gradient gradient;
      std::vector<TermSlope> slopes;
      for (const FitRowIndex j : IndexRange(FitRowIndex(first), FitRowIndex(last))) {
        const RowIndex row = problem_.rows[j];
        slopes.clear();
        if (wanted) AddSlopes(model, row, slopes);
        deflection::InfluenceSet touched;
        for (const TermSlope& of : slopes) touched.set(static_cast<std::size_t>(of.entry));
        const bool cached = wanted && IsCached(j, touched);
        if (!at_rows.At(row, cached ? deflection::InfluenceSet() : touched, scratch, at,
                        gradient)) {
          converged = false;
          return;
        }
        if (wanted) CacheOrRestore(j, touched, cached, gradient);
        whitener_[j].Apply(at.residual, residuals_.PartOf(r, j));
        if (!wanted) continue;
        auto block = residuals_.PartOf(J, j);
        FillFrames(data_.session_of[row], at, whitener_[j], block);
        const int first_size = layout_.per_session * data_.sessions_count();
        for (const TermSlope& of : slopes) {
          const double unit = layout_.unit[static_cast<std::size_t>(of.column)];
          whitener_[j].Times(unit).Add(-of.slope, gradient.col(of.entry),
                                       block.col(first_size + of.column));
        }
      }
    });
    return converged;
  }

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// d prediction / d influence of one row, for the entries on which effects act, ascending.
  struct CachedGradient {
    deflection::InfluenceSet entries;
    Eigen::MatrixXd columns;
  };

  bool IsCached(FitRowIndex j, const deflection::InfluenceSet& touched) const {
    return !cached_.empty() && touched.any() && (touched & ~cached_[j].entries).none();
  }

  /// Restores the cached columns of a gradient, or caches those just computed.
  void CacheOrRestore(FitRowIndex j, const deflection::InfluenceSet& touched, bool cached,
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
  void FillFrames(SessionIndex session, const LinearRow& at, const RowWhitening& whitening,
                  BlockRows& block) const {
    const FrameGradient negative = -at.frames;
    int column = layout_.per_session * session.value();
    if (layout_.frames) {
      whitening.Apply(negative.leftCols<6>(), block.middleCols(column, 6));
      column += 6;
    }
    if (layout_.tip) whitening.Apply(negative.rightCols<3>(), block.middleCols(column, 3));
  }

  /// d influence / d parameter at one row; columns as in the layout.
  void AddSlopes(const Model& model, RowIndex row, std::vector<TermSlope>& slopes) const {
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
        slopes[k].column = columns[static_cast<std::size_t>(slopes[k].column)];
      }
    }
  }

  const FitProblem& problem_;
  const Dataset& data_;
  const Model& start_;
  const Layout& layout_;
  Whitener whitener_;
  FitLayout residuals_;
  int size_ = 0;
  mutable Indexed<FitRowIndex, CachedGradient> cached_;  ///< empty: nothing is cached
};

}  // namespace

Result<Refit> RefitModel(const FitProblem& problem, const Model& start,
                         const RefitOptions& options) {
  const Layout layout = LayoutOf(problem.data, start, options.frames_only);
  auto cost = std::make_unique<AllRows>(problem, start, layout);
  const int size = cost->size();
  Refit refit;
  refit.model = start;
  refit.parameters = layout.parameters;
  std::vector<double> x(static_cast<std::size_t>(size), 0.0);
  std::vector<double> residuals(static_cast<std::size_t>(cost->num_residuals()));
  std::vector<double> J(residuals.size() * x.size());
  AllRows* rows = cost.get();
  if (size > 0) {
    ceres::Problem solved;
    solved.AddResidualBlock(cost.release(), nullptr, x.data());
    SetBounds(layout, start, x, solved);
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.max_num_iterations = options.iterations;
    solver.logging_type = ceres::SILENT;
    solver.function_tolerance = 1e-8;
    solver.parameter_tolerance = 1e-10;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &solved, &summary);
    if (!summary.IsSolutionUsable()) return Error{"the refit did not converge: " + summary.message};
    refit.model = Moved(layout, start, x.data());
    const double* at[] = {x.data()};
    double* jacobian[] = {J.data()};
    rows->ClearGradients();
    if (!rows->Evaluate(at, residuals.data(), jacobian))
      return Error{"the deflected posture of the refitted model does not converge"};
  } else {
    const double none = 0;
    const double* at[] = {&none};
    if (!rows->Evaluate(at, residuals.data(), nullptr))
      return Error{"the deflected posture does not converge"};
  }
  for (const double r : residuals) refit.chi2 += r * r;
  const auto count = static_cast<int>(layout.parameters.size());
  if (count > 0) {
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Rows> jacobian(J.data(), static_cast<int>(residuals.size()), size);
    const Eigen::MatrixXd information = jacobian.transpose() * jacobian;
    // Scaled to a unit diagonal before inversion, since the parameters differ by many orders of
    // magnitude.
    const Eigen::VectorXd scale =
        information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
    const Inverse inverse = InverseOfDetermined(scaled);
    const Eigen::MatrixXd all = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();
    refit.covariance.resize(count, count);
    const int first = size - count;
    refit.identifiable.assign(inverse.identifiable.begin() + first, inverse.identifiable.end());
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) {
        refit.covariance(i, j) = all(first + i, first + j) *
                                 layout.unit[static_cast<std::size_t>(i)] *
                                 layout.unit[static_cast<std::size_t>(j)];
      }
    }
  }
  return refit;
}

}  // namespace plumbline::diagnosis
