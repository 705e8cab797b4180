// Discrimination criterion: value of a measurement for separating rival explanations.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/search/search.h"

namespace plumbline::measure {

// Prior standard deviations of effect parameters, for the design of measurements.

/// Standard deviation of a zero-mean prior of each column of a block [SI of its parameter]: from a
/// published value on real machines if there is one (EffectTraits::largest_observed_rotation_rad),
/// otherwise the largest plausible value. Published values are rotations of a joint; the parameter
/// is scaled so that it causes this rotation at the row where it rotates the joint most.
/// @param problem  linearised with the gradients of all entries of the influence
Indexed<BlockColumnIndex, double> PriorSizes(const LinearProblem& problem, const Block& block);

/// T-optimal discrimination [Atkinson & Fedorov 1975, Biometrika 62(1)] over every ordered pair of
/// explanations (truth, rival): the lack of fit of the rival, refitted with all columns of its
/// blocks, if the first explanation is the truth. For a row with the displacement f of the truth
/// and the columns X of the rival, free frames included (both in units of sigma),
///   e = f - X theta,  S = 1 + X H^-1 X^T,  d^2 = e^T S^-1 e
/// is the increase of the rival's chi2 that the row causes after refitting (recursive least
/// squares); the sum over all rows is its total chi2. Columns are scaled by `PriorSizes`, one
/// standard deviation of the prior, so that H is regular. Linearised about the arm without effects,
/// as the search is. Two explanations are separated when the lack of fit of each, with the other as
/// the truth, suffices to rule it out.
class Discrimination {
 public:
  /// @param candidate_set          must outlive this object
  /// @param explanations  two or more, as columns of `candidate_set`; the first is the answer
  Discrimination(const CandidateSet& candidate_set, const std::vector<Explanation>& explanations);

  /// Value of measuring a candidate: the sum of d^2 over pairs, weighted by the probability of the
  /// truth. The part of d^2 beyond what a pair still needs counts a tenth, up to the same amount
  /// again; separated pairs count nothing.
  double Gain(const Dataset& candidates, const Linearisation& linear, RowIndex row) const;
  /// Largest distance of a refitted rival from the answer at a candidate [m].
  double LargestDistance(const Dataset& candidates, const Linearisation& linear,
                         RowIndex row) const;
  /// Adds a candidate to the planned measurements.
  void Measure(const Dataset& candidates, const Linearisation& linear, RowIndex row);

  /// True if the planned measurements separate the answer from this explanation.
  bool Separated(std::size_t rival) const;
  bool AllSeparated() const;
  /// Marks every pair as not separated again but keeps the planned measurements, so that further
  /// poses confirm the result.
  void Restart() { reached_.setZero(); }

 private:
  /// An explanation as the scaled columns of its blocks.
  struct Side {
    std::vector<BlockIndex> blocks;
    Eigen::VectorXd unit;    ///< scale of each column, SI
    Eigen::VectorXd values;  ///< fitted, in these units
    double weight = 1;       ///< probability of being the truth, from its score
    Eigen::MatrixXd H;       ///< X^T X over the measured and planned rows, plus the prior
    Eigen::MatrixXd g;       ///< X^T f, one column per truth
    Eigen::LDLT<Eigen::MatrixXd> solver;
    Eigen::MatrixXd theta;  ///< H^-1 g
  };
  /// Columns and predictions of all sides at one row.
  struct AtRow {
    std::vector<Eigen::MatrixXd> X;
    Eigen::MatrixXd fields;  ///< displacement f, one column per truth
  };

  Side SideOf(const Explanation& explanation) const;
  AtRow At(const Dataset& data, const Linearisation& linear, RowIndex row) const;
  void Add(const AtRow& at);
  void Solve();
  Eigen::MatrixXd Distances(const AtRow& at) const;  ///< d^2, shape (truth, rival)

  const CandidateSet& candidate_set_;
  std::vector<Side> sides_;
  Eigen::MatrixXd needed_, reached_;  ///< d^2, shape (truth, rival)
};

}  // namespace plumbline::measure
