#include "app/diagnosis/shape_search.h"

#include <algorithm>

#include "app/diagnosis/block_effects.h"

namespace plumbline {

ActiveEffect ShapeSearch::EffectFrom(const Block& block,
                                     const std::map<int, double>& values) const {
  return SizesOf(block, values);
}

bool ShapesClash(const LinearProblem& problem, std::span<const Block* const> support) {
  return std::any_of(support.begin(), support.end(), [&](const Block* block) {
    const ShapeSearch* search = ShapeSearchOf(*block->term.effect);
    return search != nullptr && search->Excludes(problem, support);
  });
}

}  // namespace plumbline
