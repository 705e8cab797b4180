// Whitening of rows: scales residuals and columns to independent noise of unit variance.
#pragma once

#include "app/measure/diagnosis/fit_problem.h"

namespace plumbline::measure {

/// Whitening matrix of one row: s L^-1, with L L^T the covariance of its residuals (RowNumbers) and
/// s = sqrt(weight) / sigma.
class RowWhitening {
 public:
  RowWhitening(const RowNumbers& numbers, double factor);

  /// A copy with its factor multiplied by `factor`.
  RowWhitening Times(double factor) const;

  /// Writes the whitened `rows`, shape (count, any), to `out` of the same shape.
  template <typename Rows, typename Out>
  void Apply(const Eigen::MatrixBase<Rows>& rows, Out&& out) const {
    if (matrix_.size() == 0) {
      out = factor_ * rows;
    } else {
      out.noalias() = matrix_ * rows;
    }
  }

  /// Adds `times` the whitened `rows` to `out`.
  template <typename Rows, typename Out>
  void Add(double times, const Eigen::MatrixBase<Rows>& rows, Out&& out) const {
    if (matrix_.size() == 0) {
      out += factor_ * times * rows;
    } else {
      out.noalias() += times * (matrix_ * rows);
    }
  }

 private:
  double factor_;
  Eigen::MatrixXd matrix_;  ///< empty if the covariance is the identity
};

/// Whitening of the rows of a fit with the factor sqrt(weight) / sigma, so that the sum of squares
/// of the whitened residuals is chi2.
class Whitener {
 public:
  explicit Whitener(const FitProblem& problem);
  const RowWhitening& operator[](FitRowIndex row) const { return rows_[row]; }

 private:
  Indexed<FitRowIndex, RowWhitening> rows_;
};

}  // namespace plumbline::measure
