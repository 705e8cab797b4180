// Design of measurements that discriminate between explanations the data cannot tell apart.
#pragma once

#include <Eigen/Cholesky>

#include "app/diagnosis/search.h"

namespace plumbline {

/// Model discrimination over every ordered pair of explanations: were the first the truth, how far
/// would the second, refitted to the rows so far with all columns of its blocks, be from it? After
/// a row with the first's displacement f and the second's columns X (both in sigma, the free frames
/// among the columns)
///   e = f - X theta,  S = 1 + X H^-1 X^T,  d^2 = e^T S^-1 e
/// is what the row adds to the second's chi2 when all is refitted; its sum over rows is the chi2
/// that remains [Atkinson & Fedorov 1975, Biometrika 62(1); recursive least squares]. The columns'
/// units are their `PriorSizes`, one standard deviation of a prior, so that H is regular. Linear
/// about the arm without effects, as the search is. Two explanations are separated once chi2
/// against either, the other being the truth, reaches what rules it out.
class Discrimination {
 public:
  /// @param explanations  of the pool, two or more; the first is the answer
  Discrimination(const Pool& pool, const std::vector<Explanation>& explanations);

  /// What measuring a candidate is worth: the sum over pairs of d^2, each by the probability that
  /// its first is the truth. What goes beyond the need of a pair counts a tenth, and no more than
  /// the need again; a pair that is separated counts nothing.
  double Gain(const Dataset& candidates, const Linearisation& linear, RowIndex row) const;
  /// Farthest distance of a refitted rival from the answer at a candidate [m].
  double LargestDistance(const Dataset& candidates, const Linearisation& linear,
                         RowIndex row) const;
  /// The candidate is going to be measured.
  void Measure(const Dataset& candidates, const Linearisation& linear, RowIndex row);

  /// True where what is going to be measured separates the answer and this explanation.
  bool Separated(std::size_t rival) const;
  bool AllSeparated() const;
  /// Every pair counts as not separated again, what was measured stays: from here on, further
  /// poses confirm.
  void Restart() { reached_.setZero(); }

 private:
  /// An explanation in columns.
  struct Side {
    std::vector<BlockIndex> blocks;
    Eigen::VectorXd unit;    ///< SI size of one, of the blocks' columns
    Eigen::VectorXd values;  ///< found, in these units
    double weight = 1;       ///< that it is the truth, by its score
    Eigen::MatrixXd H;       ///< of the rows so far
    Eigen::MatrixXd g;       ///< X^T f, a column for each truth
    Eigen::LDLT<Eigen::MatrixXd> solver;
    Eigen::MatrixXd theta;  ///< H^-1 g
  };
  /// What the sides predict at one row.
  struct AtRow {
    std::vector<Eigen::MatrixXd> X;
    Eigen::MatrixXd fields;  ///< a column for each truth
  };

  Side SideOf(const Explanation& explanation) const;
  AtRow At(const Dataset& data, const Linearisation& linear, RowIndex row) const;
  void Add(const AtRow& at);
  void Solve();
  Eigen::MatrixXd Distances(const AtRow& at) const;  ///< d^2, shape (truth, rival)

  const Pool& pool_;
  std::vector<Side> sides_;
  Eigen::MatrixXd needed_, reached_;  ///< d^2, shape (truth, rival)
};

}  // namespace plumbline
