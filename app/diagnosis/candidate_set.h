// Candidate blocks as columns of one least squares problem, and explanations fitted from subsets of
// them.
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

/// Fit of a subset (support) of the blocks, without the units that cost more than they explain.
struct Explanation {
  std::vector<BlockIndex> blocks;    ///< ascending
  std::vector<ColumnIndex> columns;  ///< kept columns of the candidate set
  Eigen::VectorXd values;            ///< fitted values of those columns, SI
  double chi2 = 0;                   ///< of the residual
  double prior = 0;                  ///< sum of (value / plausible)^2
  double score = 0;                  ///< chi2 + (value / plausible)^2 of each column + cost;
                                     ///< -2 ln(evidence) up to a constant
};

/// Identifies an effect in an explanation: its id and its variant, if it has one ("base", "move").
/// Two variants of one id are different effects.
struct EffectKey {
  std::string id, word;
  auto operator<=>(const EffectKey&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Blocks with their projected columns and Gram matrix. The prior of each value is normal with mean
/// 0; its standard deviation is the largest size plausible for a healthy machine. The prior is
/// negligible if the rows determine the value; otherwise it favours the more plausible explanation.
class CandidateSet {
 public:
  explicit CandidateSet(const LinearProblem& problem);

  /// Adds a block unless one with the same columns exists. Returns its index.
  BlockIndex Add(const Block& block) { return Add(std::vector<Block>{block}).front(); }
  /// The same for several blocks; much faster than one by one.
  std::vector<BlockIndex> Add(const std::vector<Block>& blocks);

  const LinearProblem& problem() const { return problem_; }
  const Indexed<BlockIndex, Block>& blocks() const { return blocks_; }
  /// False if the free frames absorb every column of the block.
  bool Observable(BlockIndex block) const;
  double chi2_null() const { return chi2_null_; }

  /// Fits a support: removes linearly dependent columns, then eliminates units that cost more than
  /// they explain, and units with impossible values. A value is impossible if it is far beyond the
  /// plausible size (noise along a direction that the rows hardly determine) or if physics excludes
  /// its sign.
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
  std::vector<ColumnIndex> ColumnsOf(std::vector<BlockIndex> support) const;
  /// Whitened and projected residual of an explanation.
  Eigen::VectorXd Residual(const Explanation& explanation) const;
  /// Like Residual, without subtracting the contribution of one block.
  Eigen::VectorXd PartialResidual(const Explanation& explanation, BlockIndex block) const;
  /// Fitted values by block and column.
  Coefficients CoefficientsOf(const Explanation& explanation) const;
  /// The blocks of an explanation that belong to an effect, and those that do not.
  std::vector<BlockIndex> BlocksOf(const Explanation& explanation, const EffectKey& key) const;
  std::vector<BlockIndex> OtherBlocks(const Explanation& explanation, const EffectKey& key) const;
  /// Share (0..1) of an effect's displacement in an explanation that the blocks of a rival cannot
  /// reproduce.
  double SignalLeft(const Explanation& explanation, const EffectKey& key,
                    const std::vector<BlockIndex>& rival) const;
  /// Smallest 3-D RMS displacement over the rows [m] at which each column alone is detected with
  /// power 0.9; 0 if that requires a size beyond the plausible one.
  /// @param block_cost  cost of the choice of the block's shape, as BlockCost
  Indexed<BlockColumnIndex, double> MinimumDetectable(BlockIndex block, double block_cost) const;

  /// ln of the number of ways to choose the kept units (joints) of a block from the observable
  /// ones.
  double LogChoices(const Explanation& explanation, BlockIndex block) const;

  double UnitCost(BlockIndex block, int unit) const {
    return unit_costs_[block][static_cast<std::size_t>(unit)];
  }
  double BlockCost(BlockIndex block) const;
  /// Cost of selecting one effect from the catalogue, 2 ln(EffectsConsidered).
  double EffectCost() const { return effect_cost_; }
  /// Factor (at least 1) by which correlated noise increases the chi2 that a block explains by
  /// chance. Its costs, which hold for independent noise, are multiplied by it.
  double Inflation(BlockIndex block) const { return inflation_[block]; }

  const Eigen::MatrixXd& columns() const { return columns_; }
  /// 0-based; -1 if the column belongs to no joint.
  int JointOfColumn(ColumnIndex column) const;
  BlockIndex BlockOfColumn(ColumnIndex column) const { return block_of_[column]; }
  BlockColumnIndex WithinBlock(ColumnIndex column) const { return local_[column]; }
  int UnitOfColumn(ColumnIndex column) const { return ColumnAt(column).unit; }

 private:
  IndexRange<ColumnIndex> ColumnsIn(BlockIndex block) const;
  /// Lists a block without its columns.
  BlockIndex List(const Block& block);
  /// Computes and scales the columns of the listed blocks from this one on.
  void AddColumns(BlockIndex first);
  /// Extends the Gram matrix by the last `width` columns.
  void ExtendGram(int width);
  /// Prior precision of the value of a column scaled to unit length.
  double PriorPrecision(ColumnIndex column) const;
  /// Allowed range of the value of a column scaled to unit length.
  model::Interval Bounds(ColumnIndex column) const;
  const BlockColumn& ColumnAt(ColumnIndex column) const {
    return blocks_[block_of_[column]].columns[local_[column]];
  }
  /// Norm of a whitened column over the residuals that are lengths; orientation residuals of poses
  /// are excluded, since they are not in millimetres. The lengths of a row come first, so whitening
  /// by a Cholesky factor does not mix orientations into them.
  double LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const;
  Eigen::VectorXd ResidualBeside(const Explanation& explanation,
                                 std::optional<BlockIndex> left_in) const;
  std::vector<double> UnitCosts(BlockIndex block) const;
  /// Linearly independent, well-conditioned columns, and chi2 after fitting them.
  struct Basis {
    std::vector<ColumnIndex> columns;
    double chi2 = 0;
  };
  Basis IndependentColumns(const std::vector<ColumnIndex>& columns) const;
  /// Minimum cost of an explanation with at least one unit of each block.
  double MinCost(const std::vector<ColumnIndex>& columns) const;
  /// Number of effects that blocks represent, each weighted by its inflation. Blocks of one id are
  /// one effect, except that each event counts separately.
  double WeightedEffectCount(const std::set<BlockIndex>& blocks) const;
  SupportFit FitOf(const std::vector<ColumnIndex>& columns) const;
  /// The fit as an explanation: values in SI, and the score including all costs.
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

/// True if an explanation contains an empirical term.
bool HasEmpirical(const CandidateSet& candidate_set, const Explanation& explanation);

/// The distinct effects of an explanation, ascending.
std::vector<EffectKey> EffectKeys(const CandidateSet& candidate_set,
                                  const Explanation& explanation);
/// The distinct ids of the effects of an explanation, ascending.
std::vector<std::string> EffectIds(const CandidateSet& candidate_set,
                                   const Explanation& explanation);

}  // namespace plumbline::diagnosis
