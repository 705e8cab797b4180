// Costs of selecting effects, blocks and units (joints), in units of chi2.
#pragma once

#include <set>
#include <vector>

#include "app/measure/diagnosis/candidate_columns.h"

namespace plumbline::measure {

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

}  // namespace plumbline::measure
