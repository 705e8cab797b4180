// Penalised least squares with backward elimination of units of columns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/measure/diagnosis/data/indices.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Minimiser v of |y - X v|^2 + v^T P v with a diagonal prior precision P. Units of columns are
/// dropped by downdating the inverse, O(n^2) per column; X itself is not needed.
class SupportFit {
 public:
  /// Columns that are kept or dropped together.
  struct Unit {
    BlockIndex block;         ///< of the candidate set
    int number = 0;           ///< within the block
    std::vector<int> places;  ///< its columns, 0..n-1
    double cost = 0;          ///< of keeping the unit, in chi2
  };

  /// @param gram       X^T X + P, shape (n, n); positive definite
  /// @param moment     X^T y, shape (n)
  /// @param chi2_null  |y|^2
  /// @param units      each column belongs to exactly one
  SupportFit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double chi2_null,
             std::vector<Unit> units);

  /// Backward elimination: repeatedly drops the unit whose cost exceeds the rise of the minimum
  /// most, until no cost does.
  void Eliminate();
  /// Among the units with a value outside its bounds, drops the one that raises the minimum least.
  /// @param bounds  of the value of each column
  /// @return        false if every value is within its bounds
  bool DropOutOfBounds(const std::vector<model::Interval>& bounds);

  /// Minimum of the objective: chi2 plus the prior term.
  double minimum() const { return minimum_; }
  /// Value of a kept column.
  double Value(int place) const { return values_[at_[place]]; }
  /// The kept units.
  const std::vector<Unit>& units() const { return units_; }
  /// Columns of the kept units, ascending.
  std::vector<int> Places() const;

 private:
  using Units = std::vector<Unit>;

  double RiseWithout(const Unit& unit) const;
  void Drop(Units::iterator unit, double rise);
  void Drop(int place);

  // Kept columns come first; column `place` is stored at index at_[place].
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd values_;
  Eigen::Index left_;
  std::vector<int> at_, place_of_;
  double minimum_;
  Units units_;
};

}  // namespace plumbline::measure
