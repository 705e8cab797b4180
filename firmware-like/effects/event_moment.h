// Event time: code shared by the effects that start at an event.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// True if the event time of a term, its `time` [s] or `row`, has been reached under these
/// conditions.
template <typename T>
bool HasHappened(const EffectTerm& term, std::span<const T> values, const Conditions& conditions) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto spec = static_cast<std::size_t>(term.parameters[k].spec);
    const ParameterSpec& of = term.effect->traits().parameters[spec];
    if (!IsEventTime(of)) continue;
    const std::optional<double>& now = of.name == "time" ? conditions.t_s : conditions.row;
    if (now && *now >= values[k]) return true;
  }
  return false;
}

}  // namespace plumbline::effects
