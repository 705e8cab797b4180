// Search for the shape with which an effect acts: cycles, a time constant, a moment, a phase.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "app/diagnosis/block_effects.h"
#include "app/diagnosis/linear_problem.h"

namespace plumbline {

/// What the diagnosis must know of an effect that is not linear in all of its parameters; one
/// object an effect, without state, registered in shape_search_table.cc. An effect without one has
/// sizes only, and its block is WholeBlock.
class ShapeSearch {
 public:
  ShapeSearch() = default;
  virtual ~ShapeSearch() = default;
  ShapeSearch(const ShapeSearch&) = delete;
  ShapeSearch& operator=(const ShapeSearch&) = delete;

  /// False where every shape that matters is in the columns of Fixed().
  virtual bool FollowsResidual() const { return true; }
  /// Blocks that are offered whatever the residual is.
  virtual std::vector<Block> Fixed(const Dataset& /*data*/) const { return {}; }
  /// Blocks with the best shapes for a residual, whitened and projected.
  virtual std::vector<Block> Propose(const LinearProblem& /*problem*/,
                                     const Eigen::VectorXd& /*residual*/) const {
    return {};
  }
  /// Blocks with the shapes of an effect that was refitted.
  virtual std::vector<Block> Refitted(const Dataset& /*data*/,
                                      const ActiveEffect& /*effect*/) const {
    return {};
  }
  /// One block for each place where the effect may be, however little it is there now: what would
  /// have been seen must hold wherever it is. Empty where Propose() depends on no place.
  virtual std::vector<Block> Everywhere(const Dataset& /*data*/) const { return {}; }

  /// The effect that a fitted block stands for.
  /// @param values  of the block's columns that were kept, SI
  virtual ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const;
  /// True where several blocks are one effect of a file.
  virtual bool SeveralInOne() const { return false; }
  /// Adds another block's effect to one of the same effect and word, where SeveralInOne().
  virtual void Join(const ActiveEffect& /*more*/, ActiveEffect& /*effect*/) const {}

  /// True where the rows of a problem leave open whether a block acts at another row: one between
  /// the last row before a step and the first after it. No model predicts such a row.
  virtual bool LeavesOpen(const LinearProblem& /*problem*/, const Block& /*block*/,
                          RowIndex /*row*/) const {
    return false;
  }

  /// True where blocks of this effect cannot stand together, or beside others, in one explanation.
  /// @param support  all blocks of the explanation, in its order
  virtual bool Excludes(const LinearProblem& /*problem*/,
                        std::span<const Block* const> /*support*/) const {
    return false;
  }
};

/// The search of an effect's shapes; null where it has none.
const ShapeSearch* ShapeSearchOf(const Effect& effect);

/// True where the search of one of its effects excludes the support.
bool ShapesClash(const LinearProblem& problem, std::span<const Block* const> support);

}  // namespace plumbline
