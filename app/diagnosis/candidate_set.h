// Blocks as columns of one least squares problem, and explanations: which of them are kept, and at
// what score.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/diagnosis/block_effects.h"
#include "app/diagnosis/candidates.h"
#include "app/diagnosis/linear_problem.h"
#include "app/diagnosis/support_fit.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {

/// What a support of blocks explains, the joints that do not earn their place dropped.
struct Explanation {
  std::vector<BlockIndex> blocks;    ///< ascending
  std::vector<ColumnIndex> columns;  ///< of the candidate set, that were kept
  Eigen::VectorXd values;            ///< of those columns, SI
  double chi2 = 0;                   ///< that remains
  double prior = 0;                  ///< sum of (value / plausible)^2
  double score = 0;                  ///< chi2 + (value / plausible)^2 of each column + cost;
                                     ///< -2 ln(evidence) up to a constant
};

/// An effect as an explanation names it: its id, and its word where it has one ("base", "move").
/// Two words of one id are two explanations.
struct EffectKey {
  std::string id, word;
  auto operator<=>(const EffectKey&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Blocks with their projected columns and Gram matrix. Each value has a normal prior about 0 whose
/// deviation is the largest size that a sound machine shows: where the rows decide it hardly
/// counts, where they do not the more plausible explanation is the better one.
class CandidateSet {
 public:
  explicit CandidateSet(const LinearProblem& problem);

  /// Adds a block; the same one is not added twice. Returns its index.
  BlockIndex Add(const Block& block);

  const LinearProblem& problem() const { return problem_; }
  const Indexed<BlockIndex, Block>& blocks() const { return blocks_; }
  /// False where the frames imitate all of the block.
  bool Observable(BlockIndex block) const;
  double chi2_null() const { return chi2_null_; }

  /// Fits a support: rank first, then backward elimination of units that cost more than they bring,
  /// and of values that no machine shows: far beyond the plausible ones, noise along a direction
  /// that the rows hardly hold, or of a sign that physics excludes.
  Explanation Evaluate(std::vector<BlockIndex> support) const;
  /// The same; nothing where no explanation that keeps every block can score below `worst`. The
  /// bound is chi2 before elimination plus the cheapest unit of each block; explanations by fewer
  /// of the blocks belong to the smaller support.
  std::optional<Explanation> EvaluateBelow(std::vector<BlockIndex> support, double worst) const;
  /// Fits exactly these units of blocks, nothing eliminated but what has no rank.
  Explanation Fit(const std::vector<BlockIndex>& support) const;
  /// Fits these columns, ascending; only those without rank are left out.
  Explanation FitColumns(const std::vector<ColumnIndex>& columns) const;
  /// The columns of a support that move the tip at all, ascending.
  std::vector<ColumnIndex> ColumnsOf(std::vector<BlockIndex> support) const;
  /// Whitened and projected residual of an explanation.
  Eigen::VectorXd Residual(const Explanation& explanation) const;
  /// The same with the contribution of one of its blocks left in.
  Eigen::VectorXd PartialResidual(const Explanation& explanation, BlockIndex block) const;
  /// (block, column) -> value.
  Coefficients CoefficientsOf(const Explanation& explanation) const;
  /// Blocks of an explanation that belong to an effect, and the others.
  std::vector<BlockIndex> BlocksOf(const Explanation& explanation, const EffectKey& key) const;
  std::vector<BlockIndex> OtherBlocks(const Explanation& explanation, const EffectKey& key) const;
  /// Share (0..1) of the displacement that an explanation gives to an effect which a support
  /// cannot imitate.
  double SignalLeft(const Explanation& explanation, const EffectKey& key,
                    const std::vector<BlockIndex>& rival) const;
  /// Smallest 3-D RMS displacement over the rows [m] of each column by itself that would be found
  /// with power 0.9; 0 where that needs more than a sound machine shows.
  /// @param block_cost  of the choice of the block's shape, as BlockCost
  Indexed<BlockColumnIndex, double> MinimumDetectable(BlockIndex block, double block_cost) const;

  /// ln of the ways to choose the joints of a block that an explanation kept among those visible.
  double LogChoices(const Explanation& explanation, BlockIndex block) const;

  double UnitCost(BlockIndex block, int unit) const {
    return unit_costs_[block][static_cast<std::size_t>(unit)];
  }
  double BlockCost(BlockIndex block) const;
  /// What each whole effect costs for its choice among all, 2 ln(EffectsConsidered).
  double EffectCost() const { return effect_cost_; }
  /// Times by which correlated noise raises what a block explains by chance, 1 and more: its costs
  /// are raised as much, since each is what independent noise reaches.
  double Inflation(BlockIndex block) const { return inflation_[block]; }

  const Eigen::MatrixXd& columns() const { return columns_; }
  /// 0-based; -1 where the column belongs to no joint.
  int JointOfColumn(ColumnIndex column) const;
  BlockIndex BlockOfColumn(ColumnIndex column) const { return block_of_[column]; }
  int UnitOfColumn(ColumnIndex column) const { return ColumnAt(column).unit; }

 private:
  IndexRange<ColumnIndex> ColumnsIn(BlockIndex block) const;
  /// Of the value of a column of unit length.
  double PriorPrecision(ColumnIndex column) const;
  /// What the value of a column of unit length may be.
  model::Interval Bounds(ColumnIndex column) const;
  const BlockColumn& ColumnAt(ColumnIndex column) const {
    return blocks_[block_of_[column]].columns[local_[column]];
  }
  /// Length of a whitened column, of the residuals that are lengths alone: turns of a measured pose
  /// are no millimetres. A row's lengths come first, and whitening by a Cholesky factor leaves them
  /// apart from what follows.
  double LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const;
  Eigen::VectorXd ResidualBeside(const Explanation& explanation,
                                 std::optional<BlockIndex> left_in) const;
  std::vector<double> UnitCosts(BlockIndex block) const;
  /// Columns that are well conditioned together, and the chi2 that they leave.
  struct Basis {
    std::vector<ColumnIndex> columns;
    double chi2 = 0;
  };
  Basis Ranked(const std::vector<ColumnIndex>& columns) const;
  /// The least that an explanation with at least one unit of each block costs.
  double LeastCost(const std::vector<ColumnIndex>& columns) const;
  /// Whole effects that blocks claim, each by its inflation: those of one id are one effect, but
  /// each event is a claim of its own, however often another one happened.
  double Claims(const std::set<BlockIndex>& blocks) const;
  SupportFit FitOf(const std::vector<ColumnIndex>& columns) const;
  /// Values in SI, and the score with every cost.
  Explanation ExplanationOf(const std::vector<ColumnIndex>& columns, const SupportFit& fit) const;

  const LinearProblem& problem_;
  Indexed<BlockIndex, Block> blocks_;
  Indexed<BlockIndex, ColumnIndex> first_;  ///< column of each block
  Indexed<ColumnIndex, BlockIndex> block_of_;
  Indexed<ColumnIndex, BlockColumnIndex> local_;
  Indexed<BlockIndex, double> inflation_;
  Indexed<BlockIndex, std::vector<double>> unit_costs_;
  Eigen::MatrixXd columns_;  ///< projected, unit length (or zero)
  int used_ = 0;
  Eigen::MatrixXd gram_;                    ///< columns^T columns
  Eigen::VectorXd moment_;                  ///< columns^T response
  Indexed<ColumnIndex, double> length_;     ///< projected length before normalising
  Indexed<ColumnIndex, double> raw_rms_m_;  ///< 3-D RMS of the raw column per unit of parameter [m]
  double chi2_null_ = 0;
  double effect_cost_ = 0;
};

EffectKey KeyOf(const Block& block);

/// Whether an explanation needs an empirical term.
bool HasEmpirical(const CandidateSet& candidate_set, const Explanation& explanation);

/// The effects of an explanation, distinct, ascending.
std::vector<EffectKey> EffectKeys(const CandidateSet& candidate_set,
                                  const Explanation& explanation);
/// Their ids.
std::vector<std::string> EffectIds(const CandidateSet& candidate_set,
                                   const Explanation& explanation);

}  // namespace plumbline::diagnosis
