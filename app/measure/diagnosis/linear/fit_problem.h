// Weighted least squares problem over rows of a data set: participating rows, weights and noise.
#pragma once

#include "app/measure/diagnosis/data/dataset.h"

namespace plumbline::measure {

/// A weighted least squares problem over rows of a data set.
struct FitProblem {
  const Dataset& data;     ///< must outlive the problem
  FitRows rows;            ///< participating rows; others have no influence
  PerRow<double> weights;  ///< of all rows, 0..1
  double sigma_m = 0;      ///< standard deviation of the noise, one axis
  int threads = 1;
  double row_correlation = 0;  ///< correlation of the noise of successive rows, 0..1

  /// The residuals of the rows, then the equations of the nuisances as if they were one more row.
  FitLayout layout() const;
  /// The same data, weights and noise with other participating rows.
  FitProblem WithRows(FitRows other) const {
    return {data, std::move(other), weights, sigma_m, threads, row_correlation};
  }
  /// The same rows, weights and noise with other data about them, for example another cell.
  FitProblem WithData(const Dataset& other) const {
    return {other, rows, weights, sigma_m, threads, row_correlation};
  }
};

/// All rows with weight 1 (0 for rows without a measurement) and the noise of the data set.
FitProblem UnitWeightFit(const Dataset& data, int threads);

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
