// When an event happened: what the effects that begin at a moment have in common.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// True where the moment of a term, its `time` [s] or its `row`, has come in these conditions.
template <typename T>
bool HasHappened(const EffectTerm& term, std::span<const T> values, const Conditions& conditions) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto spec = static_cast<std::size_t>(term.parameters[k].spec);
    const ParameterSpec& of = term.effect->traits().parameters[spec];
    if (!IsMoment(of)) continue;
    const std::optional<double>& now = of.name == "time" ? conditions.t_s : conditions.row;
    if (now && *now >= values[k]) return true;
  }
  return false;
}

}  // namespace plumbline
