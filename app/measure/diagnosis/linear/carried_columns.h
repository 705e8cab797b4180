// Products of columns that are influences times a factor of each row, without forming the columns.
#pragma once

#include <vector>

#include "app/measure/diagnosis/linear/linear_problem.h"

namespace plumbline::measure {

/// Columns c_ka = f_k(row) carrier_a(row), with the nuisances projected out. carrier_a is the
/// whitened column of entry a of the influence (LinearProblem::Carrier). The sums that do not
/// depend on the factors are computed once per row, so that a search can try many factors:
///   c_ka . c_lb = sum_i f_k f_l (carrier_a . carrier_b)
///               - sum_n (sum_i f_k carrier_a . n) (sum_i f_l carrier_b . n)
/// with i over the rows and n over the orthonormal basis of the nuisances, in which the position of
/// an artefact has a part at its own rows only. Factors are given in the order of `rows()`.
class CarriedColumns {
 public:
  CarriedColumns(const LinearProblem& problem, const std::vector<int>& entries);

  /// The rows of the problem, those on one artefact together.
  const std::vector<FitRowIndex>& rows() const { return rows_; }
  int width() const { return static_cast<int>(carriers_.cols()); }

  /// Gram matrix, ordered by k, then a, like the columns of LinearProblem::Carried.
  /// @param factors  shape (rows, k)
  Eigen::MatrixXd Gram(const Eigen::Ref<const Eigen::MatrixXd>& factors) const;
  /// Gram matrices where the one factor is 1 from a position of `sorted` on and 0 before it.
  /// @param sorted  all positions in rows(), in any order
  /// @param from    positions in `sorted`, ascending
  std::vector<Eigen::MatrixXd> GramsOfSteps(const std::vector<int>& sorted,
                                            const std::vector<int>& from) const;

  /// Products of the carriers with a residual that is already projected, shape (rows, width).
  Eigen::MatrixXd Along(const Eigen::VectorXd& residual) const;
  /// Products of the columns with that residual, ordered like the Gram matrix.
  static Eigen::VectorXd Moments(const Eigen::Ref<const Eigen::MatrixXd>& factors,
                                 const Eigen::MatrixXd& along);
  /// carrier_a . carrier_a of each row.
  Eigen::VectorXd Squares(int a) const { return products_.col(NumberOf(a, a)); }

 private:
  /// Rows that a part of the basis covers.
  struct Segment {
    int first = 0;
    /// Projection carrier_a . n of each row, a column for each pair, ordered by a, then n; shape
    /// (rows of the segment, columns).
    Eigen::MatrixXd along_basis;
    Eigen::Index rank = 0;
  };
  class StepSums;

  void AddSegment(int first, int count, const Eigen::MatrixXd& basis,
                  const std::vector<int>& first_residual);
  static Eigen::Index NumberOf(int a, int b) { return b * (b + 1) / 2 + a; }  // a <= b

  FitLayout layout_;  ///< of the problem
  std::vector<FitRowIndex> rows_;
  Eigen::MatrixXd carriers_;  ///< whitened, shape (residuals, width)
  Eigen::MatrixXd products_;  ///< carrier_a . carrier_b of each row, a <= b
  std::vector<Segment> segments_;
  std::vector<int> segment_of_;  ///< place of each row; -1: none
};

/// Inverse of a Gram matrix for gains; a direction along which its columns vanish or depend on each
/// other gains nothing.
Eigen::MatrixXd InverseForGain(Eigen::MatrixXd gram);
/// Reduction of chi2 from fitting columns with this Gram matrix and these products with the
/// residual.
double GainFrom(const Eigen::MatrixXd& gram, const Eigen::Ref<const Eigen::VectorXd>& moments);

}  // namespace plumbline::measure
