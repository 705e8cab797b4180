// Conversion of fitted blocks to effects.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/blocks.h"

namespace plumbline::measure {

/// Fitted values of columns of several blocks, SI.
using Coefficients = std::map<std::pair<BlockIndex, BlockColumnIndex>, double>;
/// Fitted values of columns of one block, SI.
using ColumnSizes = std::map<BlockColumnIndex, double>;

/// The effects represented by fitted columns. Blocks of one effect that form one entry of a file
/// (harmonics, for example) are joined. Effects without a coefficient are omitted.
std::vector<effects::ActiveEffect> EffectsFrom(const Dataset& data,
                                               const Indexed<BlockIndex, Block>& blocks,
                                               const Coefficients& coefficients);

/// Identifies columns of a block that are kept or dropped together.
struct BlockUnit {
  BlockIndex block;
  int number = 0;                                      ///< within the block
  auto operator<=>(const BlockUnit&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Effects, and for each value of each effect the unit that it comes from; empty for empirical
/// ones.
struct EffectsOfUnits {
  std::vector<effects::ActiveEffect> effects;
  std::vector<std::vector<BlockUnit>> units;
};
EffectsOfUnits EffectsAndUnits(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                               const Coefficients& coefficients);

/// The effect of one catalogue block: with the fitted sizes and all shapes of the block.
effects::ActiveEffect EffectFromSizes(const Block& block, const ColumnSizes& values);

}  // namespace plumbline::measure
