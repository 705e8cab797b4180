// The effects that fitted blocks stand for.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// Values of some columns of blocks, SI.
using Coefficients = std::map<std::pair<BlockIndex, BlockColumnIndex>, double>;
/// The same of one block.
using ColumnSizes = std::map<BlockColumnIndex, double>;

/// The effects that coefficients of some columns of blocks stand for; harmonics of one effect are
/// joined into one. An effect without a coefficient is left out.
std::vector<ActiveEffect> EffectsFrom(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                                      const Coefficients& coefficients);

/// Columns of a block that are kept or dropped together.
struct BlockUnit {
  BlockIndex block;
  int number = 0;                                      ///< within the block
  auto operator<=>(const BlockUnit&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// The same, and of each value of each effect the unit that it came from; none of empirical ones.
struct EffectsOfUnits {
  std::vector<ActiveEffect> effects;
  std::vector<std::vector<BlockUnit>> units;
};
EffectsOfUnits EffectsAndUnits(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                               const Coefficients& coefficients);

/// The effect of one block of the catalogue: sizes that were not kept go, shapes stay.
ActiveEffect SizesOf(const Block& block, const ColumnSizes& values);

}  // namespace plumbline
