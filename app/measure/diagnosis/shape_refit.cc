#include "app/measure/diagnosis/shape_refit.h"

#include <algorithm>
#include <set>

#include "app/measure/diagnosis/elimination.h"
#include "app/measure/diagnosis/shape_search.h"

namespace plumbline::measure {
namespace {

constexpr int kMaxRows = 400;  // enough to determine shapes during a search

/// Every n-th row, at most kMaxRows in total.
FitRows EveryNth(const FitRows& rows) {
  const int step = (rows.count() + kMaxRows - 1) / kMaxRows;
  FitRows subset;
  for (int k = 0; k < rows.count(); k += step) subset.push_back(rows[FitRowIndex(k)]);
  return subset;
}

/// Blocks with the refitted shapes of an effect; empty if it has no searched shapes.
std::vector<Block> RefittedBlocks(const Dataset& data, const effects::ActiveEffect& effect) {
  const ShapeSearch* const search = ShapeSearchOf(*effect.term.effect);
  return search != nullptr ? search->Refitted(data, effect) : std::vector<Block>{};
}

}  // namespace

Explanation WithRefittedShapes(CandidateSet& candidate_set, const Explanation& chosen) {
  if (chosen.blocks.size() > kMaxRefittedBlocks) return chosen;
  const FitProblem& all_rows = candidate_set.problem().fit();
  const bool few = all_rows.rows.count() <= kMaxRows;
  const bool has_continuous_shape =
      std::ranges::any_of(chosen.blocks, [&candidate_set](BlockIndex block) {
        return HasContinuousShape(candidate_set.blocks()[block]);
      });
  if (!few && !has_continuous_shape) return chosen;  // nothing below would change it
  const FitProblem fit = few ? all_rows : all_rows.WithRows(EveryNth(all_rows.rows));
  RefitOptions options;
  options.gradients = &candidate_set.problem().linear().gradients;
  const auto refit_to = [&](const Explanation& explanation) {
    Model start = candidate_set.problem().aligned();
    start.effects =
        EffectsFrom(fit.data, candidate_set.blocks(), candidate_set.CoefficientsOf(explanation));
    return RefitModel(fit, start, options);
  };
  Result<Refit> refit = refit_to(chosen);
  if (!refit) return chosen;
  RefittedExplanation kept{chosen, std::move(refit).value()};
  // A subset of the rows determines the shapes, but underestimates the evidence for a unit.
  if (few) kept = EliminateUnsupportedUnits(candidate_set, std::move(kept), refit_to);
  std::vector<const effects::Effect*> reshaped;
  std::vector<BlockIndex> blocks;
  for (const effects::ActiveEffect& effect : kept.refit.model.effects) {
    for (const Block& block : RefittedBlocks(fit.data, effect)) {
      blocks.push_back(candidate_set.Add(block));
      reshaped.push_back(effect.term.effect);
    }
  }
  std::vector<ColumnIndex> columns = candidate_set.ColumnsOf(blocks);
  for (const ColumnIndex column : kept.explanation.columns) {
    const effects::Effect* const effect =
        candidate_set.blocks()[candidate_set.BlockOfColumn(column)].term.effect;
    if (std::ranges::find(reshaped, effect) == reshaped.end()) {
      columns.push_back(column);
    }
  }
  std::ranges::sort(columns);
  std::vector<BlockIndex> support;
  for (const ColumnIndex column : columns) support.push_back(candidate_set.BlockOfColumn(column));
  std::vector<const Block*> shapes;
  for (const BlockIndex block : std::set<BlockIndex>(support.begin(), support.end())) {
    shapes.push_back(&candidate_set.blocks()[block]);
  }
  const auto better = [](const Explanation& a, const Explanation& b) { return a.score < b.score; };
  const Explanation& unshaped = std::min(chosen, kept.explanation, better);
  if (ShapesConflict(candidate_set.problem(), shapes)) return unshaped;
  return std::min(unshaped, candidate_set.Evaluate(support), better);
}

}  // namespace plumbline::measure
