#include "app/measure/diagnosis/block_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/legendre.h"
#include "app/measure/diagnosis/shape_search.h"
#include "firmware-like/effects/written.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
constexpr int kCurveNodes = 33;  // of an empirical curve
constexpr int kGridNodes = 9;    // along each driver of an empirical surface

std::string CarrierName(int entry, double& from_SI) {
  from_SI = 1;
  if (entry >= I::kBase && entry < I::kBase + 3) {
    from_SI = 1e3;
    return fmt::format("base_{}", "xyz"[entry - I::kBase]);
  }
  if (entry >= I::kTip && entry < I::kTip + 3) {
    from_SI = 1e3;
    return fmt::format("tip_{}", "xyz"[entry - I::kTip]);
  }
  if (entry == I::kBendRatio) return "tool_bending";
  const int joint = entry % model::kMaxJoints + 1;
  const int kind = entry / model::kMaxJoints;
  if (kind == I::kTurn) return fmt::format("q{}", joint);
  from_SI = 1e3;
  return fmt::format("{}{}", kind == I::kLengthA ? "a" : "d", joint);
}

/// Values of the drivers at the nodes of a curve or grid, evenly spaced over their ranges.
Eigen::MatrixXd DriversAtNodes(const Dataset& data, const BlockColumn& column) {
  const auto value = [&](SignalIndex index, int node, int count) {
    const RecordedSignal& signal = data.signals[index];
    return signal.low + (signal.high - signal.low) * node / (count - 1);
  };
  if (!column.second_signal) {
    Eigen::MatrixXd drivers(kCurveNodes, 1);
    for (int node = 0; node < kCurveNodes; ++node) {
      drivers(node, 0) = value(*column.signal, node, kCurveNodes);
    }
    return drivers;
  }
  Eigen::MatrixXd drivers(kGridNodes * kGridNodes, 2);
  for (int node = 0; node < drivers.rows(); ++node) {
    drivers(node, 0) = value(*column.signal, node / kGridNodes, kGridNodes);
    drivers(node, 1) = value(*column.second_signal, node % kGridNodes, kGridNodes);
  }
  return drivers;
}

effects::ActiveEffect EmpiricalEffect(const Dataset& data, const Block& block,
                                      const ColumnSizes& values) {
  const auto factor = [&](const BlockColumn& column,
                          const Eigen::Ref<const Eigen::RowVectorXd>& drivers) {
    const auto along = [&](SignalIndex index, int degree, double value) {
      return Legendre(degree, Scaled(data.signals[index], value));
    };
    const double first = along(*column.signal, column.degree, drivers[0]);
    return column.second_signal
               ? first * along(*column.second_signal, column.second_degree, drivers[1])
               : first;
  };
  std::vector<int> entries;
  for (const auto& [column, value] : values) {
    const int entry = block.columns[column].entry;
    if (std::ranges::find(entries, entry) == entries.end()) entries.push_back(entry);
  }
  model::WrittenEffect written;
  written.id = block.id;
  written.drivers = block.term.drivers;
  const Eigen::MatrixXd drivers = DriversAtNodes(data, block.columns.front());
  written.nodes.setZero(drivers.rows(), drivers.cols() + static_cast<int>(entries.size()));
  written.nodes.leftCols(drivers.cols()) = drivers;
  for (Eigen::Index node = 0; node < drivers.rows(); ++node) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      double from_SI = 1;
      CarrierName(entries[k], from_SI);
      double sum = 0;
      for (const auto& [column, value] : values) {
        const BlockColumn& fitted = block.columns[column];
        if (fitted.entry == entries[k]) sum += value * factor(fitted, drivers.row(node));
      }
      written.nodes(node, drivers.cols() + static_cast<int>(k)) = from_SI * sum;
    }
  }
  for (const int entry : entries) {
    double from_SI = 1;
    model::EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = CarrierName(entry, from_SI);
    parameter.value = 1;
    parameter.unit = "1";
  }
  return effects::ActiveFromWritten(written, data.cell);
}

}  // namespace

effects::ActiveEffect EffectFromSizes(const Block& block, const ColumnSizes& values) {
  effects::ActiveEffect effect;
  effect.term = block.term;
  effect.term.parameters.clear();
  const std::vector<double>& at = block.columns.front().values;
  const auto& specs = block.term.effect->traits().parameters;
  for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
    const effects::TermParameter& parameter = block.term.parameters[k];
    const auto column = std::ranges::find_if(
        block.columns, [&](const BlockColumn& c) { return c.parameter == static_cast<int>(k); });
    double size = at[k];
    if (column != block.columns.end()) {
      const auto value = values.find(BlockColumnIndex(column - block.columns.begin()));
      if (value == values.end()) continue;
      const effects::ParameterSpec& spec = specs[parameter.spec];
      size = spec.value_of_linear ? spec.value_of_linear(value->second) : value->second;
    }
    effect.term.parameters.push_back(parameter);
    effect.values.push_back(size);
  }
  return effect;
}

namespace {

/// The unit of each value of an effect that comes from one block.
std::vector<BlockUnit> UnitsOf(const Block& block, BlockIndex index,
                               const effects::ActiveEffect& effect) {
  std::vector<BlockUnit> units(effect.values.size(), BlockUnit{index, 0});
  if (block.units == 1) return units;
  for (std::size_t k = 0; k < units.size(); ++k) {
    const auto& parameters = block.term.parameters;
    const auto own = std::ranges::find(parameters, effect.term.parameters[k]);
    const auto column = std::ranges::find_if(block.columns, [&](const BlockColumn& of_effect) {
      return of_effect.parameter == static_cast<int>(own - parameters.begin());
    });
    if (column != block.columns.end()) units[k].number = column->unit;
  }
  return units;
}

}  // namespace

EffectsOfUnits EffectsAndUnits(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                               const Coefficients& coefficients) {
  std::map<BlockIndex, ColumnSizes> by_block;
  for (const auto& [key, value] : coefficients) by_block[key.first][key.second] = value;
  EffectsOfUnits found;
  for (const auto& [index, values] : by_block) {
    const Block& block = blocks[index];
    if (block.empirical()) {
      found.effects.push_back(EmpiricalEffect(data, block, values));
      found.units.emplace_back();
      continue;
    }
    const ShapeSearch* search = ShapeSearchOf(*block.term.effect);
    effects::ActiveEffect effect =
        search != nullptr ? search->EffectFrom(block, values) : EffectFromSizes(block, values);
    std::vector<BlockUnit> units = UnitsOf(block, index, effect);
    const auto same = std::ranges::find_if(found.effects, [&](const effects::ActiveEffect& other) {
      return other.term.effect == effect.term.effect && other.term.word == effect.term.word &&
             search != nullptr && search->JoinsBlocks();
    });
    if (same != found.effects.end()) {
      search->Join(effect, *same);
      auto& joined = found.units[same - found.effects.begin()];
      joined.insert(joined.end(), units.begin(), units.end());
    } else {
      found.effects.push_back(std::move(effect));
      found.units.push_back(std::move(units));
    }
  }
  return found;
}

std::vector<effects::ActiveEffect> EffectsFrom(const Dataset& data,
                                               const Indexed<BlockIndex, Block>& blocks,
                                               const Coefficients& coefficients) {
  return EffectsAndUnits(data, blocks, coefficients).effects;
}

}  // namespace plumbline::measure
