// Least squares of a few columns, and what is left of it when units of them go one after another.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/diagnosis/indices.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Values v that minimise |y - X v|^2 + v^T P v, P a diagonal prior precision. Units of columns are
/// dropped by updates of the inverse, O(n^2) each; the columns themselves are not needed.
class SupportFit {
 public:
  /// Columns that stay or go together.
  struct Unit {
    BlockIndex block;         ///< of the pool
    int number = 0;           ///< within the block
    std::vector<int> places;  ///< its columns, 0..n-1
    double cost = 0;          ///< of keeping it, in chi2
  };

  /// @param gram       X^T X + P, shape (n, n); positive definite
  /// @param moment     X^T y, shape (n)
  /// @param chi2_null  |y|^2
  /// @param units      every column in one of them
  SupportFit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double chi2_null,
             std::vector<Unit> units);

  /// Drops the unit that costs most beyond the rise of the minimum without it, until none does.
  void Eliminate();
  /// Drops, of the units with a value outside its bounds, the one whose loss raises the minimum
  /// least. False where every value is within them.
  /// @param bounds  of the value of each column
  bool DropOutOfBounds(const std::vector<Interval>& bounds);

  /// The minimum: chi2 and the prior's part.
  double minimum() const { return minimum_; }
  /// Of a column that stayed.
  double Value(int place) const { return values_[at_[static_cast<std::size_t>(place)]]; }
  /// Those that stayed.
  const std::vector<Unit>& units() const { return units_; }
  /// Their columns, ascending.
  std::vector<int> Places() const;

 private:
  using Units = std::vector<Unit>;

  double RiseWithout(const Unit& unit) const;
  void Drop(Units::iterator unit, double rise);
  void Drop(int place);

  // Of the columns that are left, which come first: column `place` is at at_[place].
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd values_;
  Eigen::Index left_;
  std::vector<int> at_, place_of_;
  double minimum_;
  Units units_;
};

}  // namespace plumbline
