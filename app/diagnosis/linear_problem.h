// The rows of a search as one linear problem: response, columns and free frames, whitened.
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "app/diagnosis/blocks.h"
#include "app/diagnosis/whitener.h"

namespace plumbline::diagnosis {

/// Rows with a working response y = residual + (d prediction / d influence) influence, so that the
/// unknowns are the effects' full values; whitened by sigma and the robust weights, and with the
/// frames that the cell leaves free projected out of response and columns alike.
class LinearProblem {
 public:
  /// @param linear  at `model`
  LinearProblem(FitProblem fit, std::shared_ptr<const Linearisation> linear, const Model& model);

  const FitProblem& fit() const { return fit_; }
  const Dataset& data() const { return fit_.data; }
  const Linearisation& linear() const { return *linear_; }
  /// The model at which the problem is linear, its frames alone.
  const Model& aligned() const { return aligned_; }
  const FitRows& rows() const { return fit_.rows; }
  int clusters() const { return clusters_; }
  double sigma_m() const { return fit_.sigma_m; }
  /// Residuals by their rows' weights, less the frames' numbers.
  double freedom() const { return freedom_; }
  /// Where the residuals of each row lie in response and columns.
  const FitLayout& layout() const { return layout_; }
  const Eigen::VectorXd& response() const { return response_; }
  /// Range of a joint over the rows [rad] or [m].
  double JointSpan(int joint) const { return joint_span_[static_cast<std::size_t>(joint)]; }

  /// A block's columns, whitened; `projected` with the frames taken out.
  Eigen::MatrixXd Columns(const Block& block, bool projected) const;
  void Project(Eigen::Ref<Eigen::MatrixXd> columns) const;
  /// Orthonormal basis of what the free frames move, shape (residuals, rank).
  const Eigen::MatrixXd& frames() const { return frames_; }
  /// One influence's column, whitened, not projected: what shapes multiply row by row.
  const Eigen::VectorXd& Carrier(int entry) const;
  /// Numbers of a joint that a search of shapes needs for every residual: computed once.
  const Eigen::ArrayX2d& KeptOfJoint(int joint,
                                     const std::function<Eigen::ArrayX2d()>& compute) const;
  /// Columns carrier_a f_k(row), ordered by k then a; not projected.
  /// @param factors  shape (rows, k)
  Eigen::MatrixXd Carried(const std::vector<int>& entries, const Eigen::MatrixXd& factors) const;

 private:
  FitProblem fit_;
  std::shared_ptr<const Linearisation> linear_;
  Model aligned_;
  int clusters_ = 0;
  double freedom_ = 0;
  std::vector<double> joint_span_;
  Whitener whitener_;
  FitLayout layout_;
  Eigen::MatrixXd frames_;    ///< orthonormal
  Eigen::VectorXd response_;  ///< whitened, projected
  mutable std::map<int, Eigen::VectorXd> carriers_;
  mutable std::map<int, Eigen::ArrayX2d> kept_of_joint_;
};

}  // namespace plumbline::diagnosis
