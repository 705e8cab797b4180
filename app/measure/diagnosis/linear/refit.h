// Nonlinear least squares fit of the parameters of selected effects and of the free frames.
#pragma once

#include <ceres/cost_function.h>

#include <memory>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/linear/nuisances.h"

namespace plumbline::measure {

/// The adjusted parameters, and the scales of the solver's variables: the free frames of the
/// sessions first, then the parameters. The other nuisances are variables of their own.
struct RefitLayout {
  explicit RefitLayout(const Dataset& data) : nuisances(data) {}
  int size() const { return nuisances.of_sessions() + static_cast<int>(parameters.size()); }

  Nuisances nuisances;
  std::vector<std::pair<int, int>> parameters;  ///< (effect, value)
  std::vector<double> unit;                     ///< SI value of one solver unit, for each parameter
};

/// @param frames_only  no parameter of an effect is adjusted
RefitLayout RefitLayoutOf(const Dataset& data, const Model& model, bool frames_only);

/// The start model moved by the solver's variables x: frames of each session first, then
/// parameters.
Model Moved(const RefitLayout& layout, const Model& start, const double* x);

/// Residuals of the rows that depend on one component of the nuisances, or on none, as one cost
/// function of the frames and parameters and of that component. d prediction / d influence is
/// computed once, at the first evaluation, and reused: a refit starts close to the solution, so the
/// posture of the arm and hence these gradients change by less than a thousandth. d influence / d
/// parameter is computed at every evaluation. The approximation affects the path to the minimum,
/// and the minimum itself by a thousandth of the noise.
class RowsCost final : public ceres::CostFunction {
 public:
  /// The arguments must outlive this object.
  /// @param component  nullopt for rows that depend on none
  /// @param first_order  RefitOptions::first_order
  RowsCost(const FitProblem& problem, const Model& start, const RefitLayout& layout,
           const Whitener& whitener, std::vector<FitRowIndex> rows,
           std::optional<ComponentIndex> component, const LinearProblem* first_order);

  int own() const { return own_; }
  /// Threads of each evaluation; one where the solver evaluates several costs at once.
  void UseThreads(int threads) { threads_ = threads; }
  /// Discards the cached gradients; the next evaluation recomputes them.
  void ClearGradients() { cached_.clear(); }
  /// The model moved by the solver's variables of this component.
  void MoveOwn(const double* x, Model& model) const;
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override;

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// d prediction / d influence of one row, for the entries on which effects act, ascending.
  struct CachedGradient {
    deflection::InfluenceSet entries;
    Eigen::MatrixXd columns;
  };

  bool IsCached(FitRowIndex j, const deflection::InfluenceSet& touched) const;
  /// Restores the cached columns of a gradient, or caches those just computed.
  void CacheOrRestore(FitRowIndex j, const deflection::InfluenceSet& touched, bool cached,
                      Gradient& gradient) const;
  template <typename BlockRows>
  void FillFrames(RowIndex row, const LinearRow& at, const RowWhitening& whitening,
                  BlockRows& block) const;
  /// The residual of a row to first order. @param x  as for Evaluate
  RowResidual FirstOrderResidual(const Model& model, RowIndex row, double const* const* x) const;
  /// Position of a group's variables among those of the component.
  int PlaceOf(GroupIndex group) const;
  template <typename BlockRows>
  void FillOwn(RowIndex row, const LinearRow& at, const RowWhitening& whitening,
               BlockRows block) const;
  void AddEquations(const Model& model, Eigen::Map<Eigen::VectorXd>& r,
                    Eigen::Map<Rows>& places) const;
  /// d influence / d parameter at one row; columns as in the layout.
  void AddSlopes(const Model& model, RowIndex row, std::vector<TermSlope>& slopes) const;

  const FitProblem& problem_;
  const Dataset& data_;
  const Model& start_;
  const RefitLayout& layout_;
  const Whitener& whitener_;
  std::vector<FitRowIndex> rows_;
  std::optional<ComponentIndex> component_;
  const LinearProblem* first_order_;
  std::vector<GroupIndex> groups_;
  FitLayout residuals_;  ///< of rows_, then of the equations
  int common_ = 0, own_ = 0, threads_;
  mutable Indexed<FitRowIndex, CachedGradient> cached_;  ///< empty if nothing is cached
};

/// The rows of a problem as cost functions, one for each component of the nuisances.
std::vector<std::unique_ptr<RowsCost>> CostsOf(const FitProblem& problem, const Model& start,
                                               const RefitLayout& layout, const Whitener& whitener,
                                               const LinearProblem* first_order);

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
  /// If set, the arm moves to first order about the linearisation of this problem, at which the
  /// start's frames must be. Effects keep their shapes, so that cycles, phases and time constants
  /// are fitted as well, without a posture of the arm for each row and iteration.
  const LinearProblem* first_order = nullptr;
};

/// Minimises sum_k w_k r_k^T C_k^-1 r_k / sigma^2 over effects and free frames by
/// Levenberg-Marquardt (Ceres) with analytic derivatives, starting from the given model; r_k are
/// the residuals of a row and C_k their covariance (RowNumbers).
/// @return  an error if a deflected posture does not converge
Result<Refit> RefitModel(const FitProblem& problem, const Model& start,
                         const RefitOptions& options);

}  // namespace plumbline::measure
