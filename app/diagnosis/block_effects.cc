#include "app/diagnosis/block_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/legendre.h"
#include "firmware-like/effects/written.h"

namespace plumbline {
namespace {

using I = Influence<double>;
constexpr int kCurveNodes = 33;  // of a written empirical curve

bool IsTwoPhases(const Block& block) {
  return block.id == "gear_periodic" || block.id == "counterbalance";
}

/// The stiffness ratio whose bending is the linear column's: 1/(1 + ratio) = 1 - coefficient.
double RatioFromBending(double coefficient) {
  constexpr double kSoftest = 0.05;
  return 1 / std::max(kSoftest, 1 - coefficient) - 1;
}

/// Joins harmonics: the second periodic term of a joint gets the specs of "q#_#_amplitude".
void JoinPeriodic(const ActiveEffect& more, ActiveEffect& effect) {
  constexpr int kSpecsOfFirst = 3;
  const int joint = more.term.parameters.front().joint;
  int harmonic = 1;
  for (const TermParameter& parameter : effect.term.parameters) {
    if (parameter.joint == joint) harmonic = std::max(harmonic, parameter.harmonic + 1);
  }
  for (std::size_t k = 0; k < more.values.size(); ++k) {
    TermParameter parameter = more.term.parameters[k];
    parameter.harmonic = harmonic;
    if (harmonic > 1) parameter.spec += kSpecsOfFirst;
    effect.term.parameters.push_back(parameter);
    effect.values.push_back(more.values[k]);
  }
}

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
  written.id = "empirical";
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
    ActiveEffect effect;
    effect.term = block.term;
    if (IsTwoPhases(block)) {
      const auto sine = values.find(0), cosine = values.find(1);
      const double a = sine == values.end() ? 0 : sine->second;
      const double b = cosine == values.end() ? 0 : cosine->second;
      effect.values = block.columns[0].values;
      effect.values.front() = std::hypot(a, b);
      effect.values.back() = std::atan2(b, a);
    } else {
      // Sizes that were not kept go; shapes stay.
      const std::vector<double>& at = block.columns[0].values;
      effect.term.parameters.clear();
      for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
        const auto column =
            std::find_if(block.columns.begin(), block.columns.end(),
                         [&](const BlockColumn& c) { return c.parameter == static_cast<int>(k); });
        if (column == block.columns.end()) {
          effect.term.parameters.push_back(block.term.parameters[k]);
          effect.values.push_back(at[k]);
          continue;
        }
        const auto value = values.find(static_cast<int>(column - block.columns.begin()));
        if (value == values.end()) continue;
        effect.term.parameters.push_back(block.term.parameters[k]);
        effect.values.push_back(block.id == "tool_stiffness" ? RatioFromBending(value->second)
                                                             : value->second);
      }
    }
    const auto same = std::find_if(effects.begin(), effects.end(), [&](const ActiveEffect& other) {
      return other.term.effect == effect.term.effect && other.term.word == effect.term.word &&
             block.id == "gear_periodic";
    });
    if (same != effects.end()) {
      JoinPeriodic(effect, *same);
    } else {
      effects.push_back(std::move(effect));
    }
  }
  return effects;
}

}  // namespace plumbline
