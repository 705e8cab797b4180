// Linear least squares problem of a search: whitened response and columns, nuisances projected out.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <typeindex>
#include <utility>

#include "app/measure/diagnosis/blocks.h"
#include "app/measure/diagnosis/nuisance_projection.h"
#include "app/measure/diagnosis/whitener.h"

namespace plumbline::measure {

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
  Eigen::VectorXd response_;  ///< whitened, projected
  mutable std::mutex mutex_;  ///< of what is computed on first use
  mutable std::map<KeptKey, std::shared_ptr<const void>> kept_;
};

}  // namespace plumbline::measure
