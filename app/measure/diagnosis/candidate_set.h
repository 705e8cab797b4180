// Set of candidate blocks, and explanations fitted from subsets of them by least squares.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/block_effects.h"
#include "app/measure/diagnosis/blocks.h"
#include "app/measure/diagnosis/candidate_columns.h"
#include "app/measure/diagnosis/candidates.h"
#include "app/measure/diagnosis/indices.h"
#include "app/measure/diagnosis/selection_costs.h"
#include "app/measure/diagnosis/support_fit.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {

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
