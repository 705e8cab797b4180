#include "app/diagnosis/block_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/legendre.h"
#include "app/diagnosis/shape_search.h"
#include "firmware-like/effects/written.h"

namespace plumbline {
namespace {

using I = Influence<double>;
constexpr int kCurveNodes = 33;  // of a written empirical curve

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
  return fmt::format("q{}", entry % kMaxJoints + 1);
}

ActiveEffect EmpiricalEffect(const Dataset& data, const Block& block,
                             const std::map<int, double>& values) {
  const RecordedSignal& signal = data.signals[static_cast<std::size_t>(block.columns[0].signal)];
  std::vector<int> entries;
  for (const auto& [column, value] : values) {
    const int entry = block.columns[static_cast<std::size_t>(column)].entry;
    if (std::find(entries.begin(), entries.end(), entry) == entries.end()) entries.push_back(entry);
  }
  WrittenEffect written;
  written.id = block.id;
  written.drivers = {signal.column};
  written.nodes.setZero(kCurveNodes, 1 + static_cast<int>(entries.size()));
  for (int node = 0; node < kCurveNodes; ++node) {
    const double u = signal.low + (signal.high - signal.low) * node / (kCurveNodes - 1);
    written.nodes(node, 0) = u;
    for (std::size_t k = 0; k < entries.size(); ++k) {
      double from_SI = 1;
      CarrierName(entries[k], from_SI);
      double sum = 0;
      for (const auto& [column, value] : values) {
        const BlockColumn& of = block.columns[static_cast<std::size_t>(column)];
        if (of.entry == entries[k]) sum += value * Legendre(of.degree, Scaled(signal, u));
      }
      written.nodes(node, 1 + static_cast<int>(k)) = from_SI * sum;
    }
  }
  for (const int entry : entries) {
    double from_SI = 1;
    EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = CarrierName(entry, from_SI);
    parameter.value = 1;
    parameter.unit = "1";
  }
  return ActiveFromWritten(written, data.cell);
}

}  // namespace

ActiveEffect SizesOf(const Block& block, const std::map<int, double>& values) {
  ActiveEffect effect;
  effect.term = block.term;
  effect.term.parameters.clear();
  const std::vector<double>& at = block.columns[0].values;
  const auto& specs = block.term.effect->traits().parameters;
  for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
    const TermParameter& parameter = block.term.parameters[k];
    const auto column =
        std::find_if(block.columns.begin(), block.columns.end(),
                     [&](const BlockColumn& c) { return c.parameter == static_cast<int>(k); });
    double size = at[k];
    if (column != block.columns.end()) {
      const auto value = values.find(static_cast<int>(column - block.columns.begin()));
      if (value == values.end()) continue;
      const ParameterSpec& spec = specs[static_cast<std::size_t>(parameter.spec)];
      size = spec.value_of_linear ? spec.value_of_linear(value->second) : value->second;
    }
    effect.term.parameters.push_back(parameter);
    effect.values.push_back(size);
  }
  return effect;
}

std::vector<ActiveEffect> EffectsFrom(const Dataset& data, const std::vector<Block>& blocks,
                                      const Coefficients& coefficients) {
  std::map<int, std::map<int, double>> by_block;
  for (const auto& [key, value] : coefficients) by_block[key.first][key.second] = value;
  std::vector<ActiveEffect> effects;
  for (const auto& [index, values] : by_block) {
    const Block& block = blocks[static_cast<std::size_t>(index)];
    if (block.empirical()) {
      effects.push_back(EmpiricalEffect(data, block, values));
      continue;
    }
    const ShapeSearch* search = ShapeSearchOf(*block.term.effect);
    ActiveEffect effect =
        search != nullptr ? search->EffectFrom(block, values) : SizesOf(block, values);
    const auto same = std::find_if(effects.begin(), effects.end(), [&](const ActiveEffect& other) {
      return other.term.effect == effect.term.effect && other.term.word == effect.term.word &&
             search != nullptr && search->SeveralInOne();
    });
    if (same != effects.end()) {
      search->Join(effect, *same);
    } else {
      effects.push_back(std::move(effect));
    }
  }
  return effects;
}

}  // namespace plumbline
