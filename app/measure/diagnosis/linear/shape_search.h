// Interface of shape searches: cycles, time constants, event times and phases of effects.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "app/measure/diagnosis/linear/blocks.h"
#include "app/measure/diagnosis/linear/candidate_set.h"
#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/refit.h"

namespace plumbline::measure {

// Backward elimination among refitted effects.

/// An explanation and its refit.
struct RefittedExplanation {
  Explanation explanation;
  Refit refit;
};

/// Refits an explanation from its linear values.
using RefitExplanation = std::function<Result<Refit>(const Explanation&)>;

/// Explanations with more blocks than this are not refitted during the search. They have no
/// nameable cause, and refitting each of their parts would take longer than the search.
inline constexpr std::size_t kMaxRefittedBlocks = 6;

/// Drops units whose removal raises the refitted chi2 by less than their cost. The linear search
/// cannot find them: only when time constants, cycles and frames are free can the other effects
/// absorb what such a unit explained. A unit is kept if the refit without it needs a value that is
/// beyond kDiscardRatio or has an excluded sign. Explanations with more than kMaxRefittedBlocks
/// blocks are returned unchanged.
/// @param refitted  as columns of the candidate set
RefittedExplanation EliminateUnsupportedUnits(const CandidateSet& candidate_set,
                                              RefittedExplanation refitted,
                                              const RefitExplanation& refit);

// Joint nonlinear refit of the shapes and sizes of an explanation.

/// Refits an explanation to the rows of the candidate set's problem. Searched shapes are replaced
/// by the refitted ones, so that, for example, a time constant and a step are estimated jointly
/// instead of one after the other; units that become superfluous are removed. Adds the refitted
/// blocks to the candidate set. Returns the given explanation if the refit fails or does not score
/// better.
Explanation WithRefittedShapes(CandidateSet& candidate_set, const Explanation& chosen);

/// Treatment of an effect that is not linear in all of its parameters. One stateless object per
/// effect, registered in shape_search_table.cc. An effect without one has only sizes and uses
/// WholeBlock.
class ShapeSearch {
 public:
  ShapeSearch() = default;
  virtual ~ShapeSearch() = default;
  ShapeSearch(const ShapeSearch&) = delete;
  ShapeSearch& operator=(const ShapeSearch&) = delete;

  /// False if Fixed() covers all relevant shapes and Propose() is not needed.
  virtual bool DependsOnResidual() const { return true; }
  /// Blocks that are candidates independently of the residual.
  virtual std::vector<Block> Fixed(const Dataset& /*data*/) const { return {}; }
  /// Blocks with the best shapes for a whitened and projected residual.
  virtual std::vector<Block> Propose(const LinearProblem& /*problem*/,
                                     const Eigen::VectorXd& /*residual*/) const {
    return {};
  }
  /// Blocks with the shapes of a refitted effect.
  virtual std::vector<Block> Refitted(const Dataset& /*data*/,
                                      const effects::ActiveEffect& /*effect*/) const {
    return {};
  }
  /// One block for each place where the effect may occur (each joint, for example), for detection
  /// limits that are valid everywhere. Empty if the effect has only one place.
  virtual std::vector<Block> AllPlacements(const Dataset& /*data*/) const { return {}; }

  /// The whitened columns of a block with a searched shape, not projected, if they are carriers
  /// times a factor of each row; nullopt if they must be computed from the effect.
  virtual std::optional<Eigen::MatrixXd> Columns(const LinearProblem& /*problem*/,
                                                 const Block& /*block*/) const {
    return std::nullopt;
  }

  /// Converts a fitted block to an effect.
  /// @param values  of the kept columns of the block, SI
  virtual effects::ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const;
  /// True if several blocks form one effect of a file.
  virtual bool JoinsBlocks() const { return false; }
  /// Joins the effect of another block to one of the same effect and variant. Used if
  /// JoinsBlocks().
  virtual void Join(const effects::ActiveEffect& /*more*/,
                    effects::ActiveEffect& /*effect*/) const {}

  /// True if the rows of a problem do not determine whether a block acts at another row, such as a
  /// row between the last row before a step and the first row after it. Such a row cannot be
  /// predicted.
  virtual bool LeavesUndetermined(const LinearProblem& /*problem*/, const Block& /*block*/,
                                  RowIndex /*row*/) const {
    return false;
  }

  /// False if the rows cannot distinguish the fitted shape from its constant limit, such as a drift
  /// that was over before the first row. The effect is then not observable as such: the constant is
  /// the simpler explanation.
  virtual bool Visible(const LinearProblem& /*problem*/,
                       const effects::ActiveEffect& /*effect*/) const {
    return true;
  }

  /// True if the blocks of this effect in a support exclude each other, or exclude other blocks.
  /// @param support  all blocks of the explanation, in its order
  virtual bool Excludes(const LinearProblem& /*problem*/,
                        std::span<const Block* const> /*support*/) const {
    return false;
  }
};

/// The shape search of an effect; null if it has none.
const ShapeSearch* ShapeSearchOf(const effects::Effect& effect);

/// True if the rows show the shape of every effect, see ShapeSearch::Visible.
bool ShapesAreVisible(const LinearProblem& problem,
                      const std::vector<effects::ActiveEffect>& effects);

/// True if the shape search of any effect in the support excludes it.
bool ShapesConflict(const LinearProblem& problem, std::span<const Block* const> support);

}  // namespace plumbline::measure
