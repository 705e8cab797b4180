// Linear least squares problem of a search: whitened response and columns, nuisances projected out.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <typeindex>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/linear/blocks.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/nuisances.h"

namespace plumbline::measure {

// Projection of a least squares problem onto the complement of its nuisance parameters.

/// Orthonormal basis of the whitened nuisance columns of a fit, and the projection that removes
/// them. Each component of artefact positions has columns only at its own rows and is
/// orthogonalised there; the frames of the sessions are orthogonalised to all of them. Directions
/// that the rows do not determine are not in the basis.
class NuisanceProjection {
 public:
  /// The part of the basis that belongs to one component.
  struct Part {
    std::vector<FitRowIndex> rows;  ///< that depend on it
    std::vector<int> residuals;  ///< positions in the stacked vectors: of the rows, then equations
    Eigen::MatrixXd basis;       ///< shape (residuals, rank)
  };

  /// @param layout  of the fit, its equations included
  NuisanceProjection(const FitProblem& fit, const Linearisation& linear, const Model& model,
                     const Whitener& whitener, const FitLayout& layout);

  /// Removes the nuisances from columns of shape (residuals, any).
  void Project(Eigen::Ref<Eigen::MatrixXd> columns) const;
  const std::vector<Part>& parts() const { return parts_; }
  /// The part of the basis that belongs to the frames of the sessions, shape (residuals, any).
  const Eigen::MatrixXd& frames() const { return frames_; }
  Eigen::Index rank() const;
  /// Squared length of the projection of one residual's axis on the nuisances, 0..1: the share of
  /// the residual that they absorb.
  double Leverage(int residual) const;

 private:
  /// Whitened columns of the frames of the sessions, then of what floats with the artefact
  /// positions.
  Eigen::MatrixXd FrameColumns(const FitProblem& fit, const Linearisation& linear,
                               const Whitener& whitener, const FitLayout& layout) const;
  void ProjectParts(Eigen::Ref<Eigen::MatrixXd> columns) const;
  void AddPart(const FitProblem& fit, const Linearisation& linear, const Model& model,
               const Whitener& whitener, const FitLayout& layout, ComponentIndex component,
               const std::vector<FitRowIndex>& rows, int& equation);

  Nuisances nuisances_;
  std::vector<Part> parts_;
  Eigen::MatrixXd frames_;
};

class CarriedColumns;

/// Rows with the working response y = residual + (d prediction / d influence) influence, so that
/// the unknowns are the full values of the effects instead of changes. Response and columns are
/// whitened by sigma and the robust weights, and the nuisances (free frames, artefact positions)
/// are projected out of both. Prior knowledge of the nuisances (Equation) follows the rows in the
/// response and in the columns.
class LinearProblem {
 public:
  /// @param linear  linearisation at `model`
  LinearProblem(FitProblem fit, std::shared_ptr<const Linearisation> linear, const Model& model);

  const FitProblem& fit() const { return fit_; }
  const Dataset& data() const { return fit_.data; }
  const Linearisation& linear() const { return *linear_; }
  /// Frames of the linearisation point, without effects.
  const Model& aligned() const { return aligned_; }
  const FitRows& rows() const { return fit_.rows; }
  int clusters() const { return clusters_; }
  double sigma_m() const { return fit_.sigma_m; }
  /// Weighted number of residuals minus the number of free frame parameters.
  double freedom() const { return freedom_; }
  /// Position of each row's residuals in the response and in the columns.
  const FitLayout& layout() const { return layout_; }
  const Eigen::VectorXd& response() const { return response_; }
  /// What the arm without effects leaves of each of rows() [m], neither whitened nor projected.
  const PerRow<RowResidual>& without_effects() const { return without_effects_; }
  /// Range of a joint over the rows [rad] or [m].
  double JointSpan(int joint) const { return joint_span_[joint]; }

  /// Whitened columns of a block; if `projected`, with the nuisances projected out.
  Eigen::MatrixXd Columns(const Block& block, bool projected) const;
  void Project(Eigen::Ref<Eigen::MatrixXd> columns) const;
  const NuisanceProjection& nuisances() const { return *nuisances_; }
  /// Whitened column of one entry of the influence, not projected. Shapes multiply it row by row.
  const Eigen::VectorXd& Carrier(int entry) const;
  /// Products of the columns of some entries of the influence, for factors of the rows.
  const CarriedColumns& CarriedBy(const std::vector<int>& entries) const;
  /// A value that a search needs for every residual of the problem, computed on first use.
  /// @tparam T    a type of the search's own
  /// @param  key  distinguishes values of the same type
  template <typename T>
  const T& Kept(int key, const std::function<T()>& compute) const {
    return *static_cast<const T*>(
        KeptAs({typeid(T), {key}}, [&] { return std::make_shared<const T>(compute()); }));
  }
  /// Columns carrier_a f_k(row), ordered by k, then a; not projected.
  /// @param factors  shape (rows, k)
  Eigen::MatrixXd Carried(const std::vector<int>& entries, const Eigen::MatrixXd& factors) const;

 private:
  using KeptKey = std::pair<std::type_index, std::vector<int>>;

  /// Not projected, and without the factors of the block.
  Eigen::MatrixXd WhitenedColumns(const Block& block) const;
  const void* KeptAs(const KeptKey& key,
                     const std::function<std::shared_ptr<const void>()>& compute) const;

  FitProblem fit_;
  std::shared_ptr<const Linearisation> linear_;
  Model aligned_;
  int clusters_ = 0;
  double freedom_ = 0;
  std::vector<double> joint_span_;
  Whitener whitener_;
  FitLayout layout_;
  int equations_ = 0;  ///< number of residuals after those of the rows
  std::unique_ptr<NuisanceProjection> nuisances_;
  PerRow<RowResidual> without_effects_;  ///< empty for rows that are not in the fit
  Eigen::VectorXd response_;             ///< whitened, projected
  mutable std::mutex mutex_;             ///< of what is computed on first use
  mutable std::map<KeptKey, std::shared_ptr<const void>> kept_;
};

// Correlation of the noise of successive rows, and the variance inflation that it causes.

/// Lag-1 autocorrelation of the residuals, pooled over all axes and sessions, 0..0.95; 0 unless
/// significant at the 0.1 % level. Pairs within one cluster are ignored, since both rows share the
/// model error at their pose, and so are pairs with a rejected row.
double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights);

/// Factor by which AR(1) noise with the fit's row correlation rho increases the variance of a
/// column's coefficient over independent noise:
///   sum_ij rho^|i-j| x_i . x_j / sum_i x_i . x_i,   i and j in one session; at least 1.
/// About (1 + rho) / (1 - rho) for a step, and 1 for a column in random order.
/// @param column  whitened and projected, shape (residuals)
double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column);

}  // namespace plumbline::measure
