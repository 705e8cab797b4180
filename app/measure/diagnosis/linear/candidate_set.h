// Set of candidate blocks, and explanations fitted from subsets of them by least squares.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/measure/diagnosis/data/indices.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/blocks.h"
#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/support_fit.h"

namespace plumbline::measure {

// Candidate blocks as projected columns of unit length, with their Gram matrix.

/// The columns of all blocks of a candidate set. Free frames are projected out; a column that they
/// absorb, or that cannot be seen at any plausible value, is zero.
class CandidateColumns {
 public:
  explicit CandidateColumns(const LinearProblem& problem) : problem_(problem) {}

  /// Adds the blocks that no listed block has the same columns as.
  /// @return  index of each block, or of the one with the same columns
  std::vector<BlockIndex> Add(const std::vector<Block>& blocks);

  const LinearProblem& problem() const { return problem_; }
  const Indexed<BlockIndex, Block>& blocks() const { return blocks_; }
  IndexRange<ColumnIndex> ColumnsIn(BlockIndex block) const;
  /// The observable columns of these blocks, ascending.
  std::vector<ColumnIndex> ObservableIn(std::vector<BlockIndex> blocks) const;

  BlockIndex BlockOf(ColumnIndex column) const { return block_of_[column]; }
  BlockColumnIndex WithinBlock(ColumnIndex column) const { return local_[column]; }
  const BlockColumn& At(ColumnIndex column) const {
    return blocks_[block_of_[column]].columns[local_[column]];
  }
  /// 0-based; -1 if the column belongs to no joint.
  int JointOf(ColumnIndex column) const;

  /// Projected length before normalising; 0 if not observable.
  double Length(ColumnIndex column) const { return length_[column]; }
  /// 3-D RMS of the raw column per unit of parameter [m].
  double RawRms_m(ColumnIndex column) const { return raw_rms_m_[column]; }
  /// Prior precision of the value of a column scaled to unit length.
  double PriorPrecision(ColumnIndex column) const;
  /// Allowed range of the value of a column scaled to unit length.
  model::Interval Bounds(ColumnIndex column) const;

  const Eigen::MatrixXd& matrix() const { return columns_; }
  double Gram(ColumnIndex a, ColumnIndex b) const { return gram_(a.value(), b.value()); }
  /// Product of a column and the response.
  double Moment(ColumnIndex column) const { return moment_[column.value()]; }

 private:
  /// Lists a block without its columns.
  BlockIndex List(const Block& block);
  /// Computes and scales the columns of the listed blocks from this one on.
  void AddColumns(BlockIndex first);
  /// Scales projected columns to unit length, or to zero if they cannot be seen.
  void Normalise(Eigen::Ref<Eigen::MatrixXd> added, const std::vector<double>& raw_lengths);
  /// Extends the Gram matrix by the last `width` columns.
  void ExtendGram(int width);
  /// Norm of a whitened column over the residuals that are lengths; orientation residuals of poses
  /// are excluded, since they are not in millimetres. The lengths of a row come first, so whitening
  /// by a Cholesky factor does not mix orientations into them.
  double LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const;

  const LinearProblem& problem_;
  Indexed<BlockIndex, Block> blocks_;
  Indexed<BlockIndex, ColumnIndex> first_;  ///< column of each block
  Indexed<ColumnIndex, BlockIndex> block_of_;
  Indexed<ColumnIndex, BlockColumnIndex> local_;
  Eigen::MatrixXd columns_;  ///< with room for further ones
  int used_ = 0;
  Eigen::MatrixXd gram_;    ///< columns^T columns
  Eigen::VectorXd moment_;  ///< columns^T response
  Indexed<ColumnIndex, double> length_;
  Indexed<ColumnIndex, double> raw_rms_m_;
};

// Costs of selecting effects, blocks and units (joints), in units of chi2.

/// A unit costs ln(clusters) per column, but at least the quantile that bounds the probability of
/// any false unit of its block; a block costs 2 ln(shapes tried), an effect 2 ln(effects
/// considered). These hold for independent noise; each is multiplied by the block's inflation.
class SelectionCosts {
 public:
  explicit SelectionCosts(const LinearProblem& problem);

  /// Adds the costs of the blocks that were listed since the last call.
  void Extend(const CandidateColumns& columns);

  double OfUnit(BlockIndex block, int unit) const { return unit_costs_[block][unit]; }
  /// Cost of the choice of the block's shape.
  double OfBlock(const Block& block, BlockIndex index) const;
  /// Cost of selecting one effect from the catalogue, 2 ln(EffectsConsidered).
  double OfEffect() const { return effect_cost_; }
  /// Factor (at least 1) by which correlated noise increases the chi2 that a block explains by
  /// chance.
  double Inflation(BlockIndex block) const { return inflation_[block]; }

  /// Minimum cost of an explanation with at least one unit of each block of these columns.
  double Minimum(const CandidateColumns& candidates, const std::vector<ColumnIndex>& columns) const;
  /// Cost of the blocks and effects of an explanation, in addition to its units.
  double OfBlocks(const CandidateColumns& columns, const std::set<BlockIndex>& blocks) const;

 private:
  std::vector<double> UnitCosts(const LinearProblem& problem, const Block& block,
                                double inflation) const;
  /// Number of effects that blocks represent, each weighted by its inflation. Blocks of one id are
  /// one effect, except that each event counts separately.
  double WeightedEffectCount(const CandidateColumns& columns,
                             const std::set<BlockIndex>& blocks) const;

  Indexed<BlockIndex, double> inflation_;
  Indexed<BlockIndex, std::vector<double>> unit_costs_;
  double effect_cost_;
};

/// Fit of a subset (support) of the blocks, without the units that cost more than they explain.
struct Explanation {
  std::vector<BlockIndex> blocks;    ///< ascending
  std::vector<ColumnIndex> columns;  ///< kept columns of the candidate set
  Eigen::VectorXd values;            ///< fitted values of those columns, SI
  double chi2 = 0;                   ///< of the residual
  double prior = 0;                  ///< sum of (value / plausible)^2
  double score = 0;                  ///< chi2 + (value / plausible)^2 of each column + cost;
                                     ///< -2 ln(evidence) up to a constant

  double prior_and_cost() const { return score - chi2; }
};

/// Identifies an effect in an explanation: its id and its variant, if it has one ("base", "move").
/// Two variants of one id are different effects.
struct EffectKey {
  std::string id, word;
  auto operator<=>(const EffectKey&) const = default;  // NOLINT(modernize-use-nullptr)
};

inline EffectKey KeyOf(const Block& block) {
  return {block.id, std::string(block.term.word)};
}

/// Blocks with their columns and the costs of selecting them. The prior of each value is normal
/// with mean 0; its standard deviation is the largest value plausible for a healthy machine. The
/// prior is negligible if the rows determine the value; otherwise it favours the more plausible
/// explanation.
class CandidateSet {
 public:
  explicit CandidateSet(const LinearProblem& problem);

  /// Adds a block unless one with the same columns exists. Returns its index.
  BlockIndex Add(const Block& block) { return Add(std::vector<Block>{block}).front(); }
  /// The same for several blocks; much faster than one by one.
  std::vector<BlockIndex> Add(const std::vector<Block>& blocks);

  const LinearProblem& problem() const { return columns_.problem(); }
  const Indexed<BlockIndex, Block>& blocks() const { return columns_.blocks(); }
  /// False if the free frames absorb every column of the block.
  bool Observable(BlockIndex block) const { return !columns_.ObservableIn({block}).empty(); }
  double chi2_null() const { return chi2_null_; }

  /// Fits a support: removes linearly dependent columns, then eliminates units that cost more than
  /// they explain, and units with impossible values. A value is impossible if it is far beyond the
  /// plausible value (noise along a direction that the rows hardly determine) or if physics
  /// excludes its sign.
  Explanation Evaluate(std::vector<BlockIndex> support) const;
  /// Like Evaluate; nullopt if no explanation that keeps every block can score below `worst`. The
  /// lower bound is chi2 before elimination plus the cheapest unit of each block. Explanations with
  /// fewer blocks are left to the smaller supports.
  std::optional<Explanation> EvaluateBelow(std::vector<BlockIndex> support, double worst) const;
  /// Fits all units of these blocks; only linearly dependent columns are removed.
  Explanation Fit(const std::vector<BlockIndex>& support) const;
  /// Fits these columns (ascending); only linearly dependent ones are removed.
  Explanation FitColumns(const std::vector<ColumnIndex>& columns) const;
  /// The observable columns of a support, ascending.
  std::vector<ColumnIndex> ColumnsOf(std::vector<BlockIndex> support) const {
    return columns_.ObservableIn(std::move(support));
  }
  /// Whitened and projected displacement of the residuals that one column causes at a value in SI.
  Eigen::VectorXd Displacement(ColumnIndex column, double value) const;
  /// Whitened and projected residual of an explanation.
  Eigen::VectorXd Residual(const Explanation& explanation) const;
  /// Like Residual, without subtracting the contribution of one block.
  Eigen::VectorXd PartialResidual(const Explanation& explanation, BlockIndex block) const;
  /// Fitted values by block and column.
  Coefficients CoefficientsOf(const Explanation& explanation) const;
  /// Smallest 3-D RMS displacement over the rows [m] at which each column alone is detected with
  /// power 0.9; 0 if that requires an implausible value.
  /// @param block_cost  cost of the choice of the block's shape, as BlockCost
  Indexed<BlockColumnIndex, double> MinimumDetectable(BlockIndex block, double block_cost) const;

  double UnitCost(BlockIndex block, int unit) const { return costs_.OfUnit(block, unit); }
  double BlockCost(BlockIndex block) const { return costs_.OfBlock(blocks()[block], block); }
  double EffectCost() const { return costs_.OfEffect(); }
  double Inflation(BlockIndex block) const { return costs_.Inflation(block); }

  const Eigen::MatrixXd& columns() const { return columns_.matrix(); }
  /// 0-based; -1 if the column belongs to no joint.
  int JointOfColumn(ColumnIndex column) const { return columns_.JointOf(column); }
  BlockIndex BlockOfColumn(ColumnIndex column) const { return columns_.BlockOf(column); }
  BlockColumnIndex WithinBlock(ColumnIndex column) const { return columns_.WithinBlock(column); }
  int UnitOfColumn(ColumnIndex column) const { return columns_.At(column).unit; }

 private:
  Eigen::VectorXd ResidualBeside(const Explanation& explanation,
                                 std::optional<BlockIndex> left_in) const;
  /// Linearly independent, well-conditioned columns, and chi2 after fitting them.
  struct Basis {
    std::vector<ColumnIndex> columns;
    double chi2 = 0;
  };
  Basis IndependentColumns(const std::vector<ColumnIndex>& columns) const;
  SupportFit FitOf(const std::vector<ColumnIndex>& columns) const;
  /// The fit as an explanation: values in SI, and the score including all costs.
  Explanation ExplanationOf(const std::vector<ColumnIndex>& columns, const SupportFit& fit) const;

  CandidateColumns columns_;
  SelectionCosts costs_;
  double chi2_null_;
};

}  // namespace plumbline::measure
