#include "app/measure/diagnosis/shape_search.h"

#include <algorithm>

namespace plumbline::measure {

effects::ActiveEffect ShapeSearch::EffectFrom(const Block& block, const ColumnSizes& values) const {
  return EffectFromSizes(block, values);
}

bool ShapesConflict(const LinearProblem& problem, std::span<const Block* const> support) {
  for (auto block = support.begin(); block != support.end(); ++block) {
    const effects::Effect* const effect = (*block)->term.effect;
    const bool already_checked =
        std::any_of(support.begin(), block,
                    [effect](const Block* earlier) { return earlier->term.effect == effect; });
    if (already_checked) continue;
    const ShapeSearch* const search = ShapeSearchOf(*effect);
    if (search != nullptr && search->Excludes(problem, support)) return true;
  }
  return false;
}

}  // namespace plumbline::measure
