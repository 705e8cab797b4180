// Least squares of a few columns, and what is left of it when units of them go one after another.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/diagnosis/indices.h"

namespace plumbline {

/// Fit of y by columns X of unit length: values = (X^T X)^-1 X^T y. Units of columns are dropped by
/// updates of the inverse, O(n^2) each; the columns themselves are not needed.
class SupportFit {
 public:
  /// Columns that stay or go together.
  struct Unit {
    BlockIndex block;         ///< of the pool
    int number = 0;           ///< within the block
    std::vector<int> places;  ///< its columns, 0..n-1
    double cost = 0;          ///< of keeping it, in chi2
  };

  /// @param gram       X^T X, shape (n, n); positive definite
  /// @param moment     X^T y, shape (n)
  /// @param chi2_null  |y|^2
  /// @param units      every column in one of them
  SupportFit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double chi2_null,
             std::vector<Unit> units);

  /// Drops the unit that costs most beyond the rise of chi2 without it, until none does.
  void Eliminate();

  double chi2() const { return chi2_; }
  /// Of a column that stayed.
  double Value(int place) const { return values_[at_[static_cast<std::size_t>(place)]]; }
  /// Those that stayed.
  const std::vector<Unit>& units() const { return units_; }
  /// Their columns, ascending.
  std::vector<int> Places() const;

 private:
  double RiseWithout(const Unit& unit) const;
  void Drop(int place);

  // Of the columns that are left, which come first: column `place` is at at_[place].
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd values_;
  Eigen::Index left_;
  std::vector<int> at_, place_of_;
  double chi2_;
  std::vector<Unit> units_;
};

}  // namespace plumbline
