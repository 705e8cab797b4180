// Whitening of rows: residuals and columns in units in which noise is independent and of size one.
#pragma once

#include "app/diagnosis/fit_problem.h"

namespace plumbline {

/// Of one row: s L^-1 with L L^T the covariance of its numbers (RowNumbers) and s a factor.
class RowWhitening {
 public:
  RowWhitening(const RowNumbers& numbers, double factor);

  /// The same with the factor multiplied.
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

  /// Adds the whitened `rows`, times a number, to `out`.
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
  Eigen::MatrixXd matrix_;  ///< empty where the covariance is the unit matrix
};

/// The rows of a fit: the factor is sqrt(weight) / sigma, so that the sum of squares of whitened
/// residuals is chi2.
class Whitener {
 public:
  explicit Whitener(const FitProblem& problem);
  const RowWhitening& operator[](FitRowIndex row) const { return rows_[row]; }

 private:
  Indexed<FitRowIndex, RowWhitening> rows_;
};

}  // namespace plumbline
