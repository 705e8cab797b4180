#include "firmware-like/effects/tilt_event.h"

#include "firmware-like/effects/event_moment.h"

namespace plumbline::effects {
namespace {

struct TiltEventFormula {
  enum Parameter { kTime, kRow, kX };

  static EffectTraits Traits() {
    return {.id = "tilt_event",
            .meaning = "the base tilted at one time: its bolts slipped, or the floor settled",
            .remedy = "find out what happened at that time; fasten the base, and align again",
            .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                           {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                           {"x", "deg", kRadPerDeg, {-1, 1}},
                           {"y", "deg", kRadPerDeg, {-1, 1}}},
            .needs = {},
            .confused_with = {"step_event", "thermal_drift", "base_tilt", "base_frame"},
            .name = "a tilt at one time"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!HasHappened(term, values, conditions)) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec >= kX) influence[Influence<T>::kBaseTilt + spec - kX] += values[k];
    }
  }
};

}  // namespace

const Effect& TiltEvent() {
  static const EffectOf<TiltEventFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
