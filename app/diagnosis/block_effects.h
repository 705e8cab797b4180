// The effects that fitted blocks stand for.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// The effects that coefficients of some columns of blocks stand for; harmonics of one effect are
/// joined into one. An effect without a coefficient is left out.
/// @param coefficients  (block, column) -> value in SI
using Coefficients = std::map<std::pair<int, int>, double>;
std::vector<ActiveEffect> EffectsFrom(const Dataset& data, const std::vector<Block>& blocks,
                                      const Coefficients& coefficients);

/// The effect of one block of the catalogue: sizes that were not kept go, shapes stay.
/// @param values  of its columns, SI
ActiveEffect SizesOf(const Block& block, const std::map<int, double>& values);

}  // namespace plumbline
