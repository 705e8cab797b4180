#include "firmware-like/effects/step_event.h"

#include "firmware-like/effects/event_moment.h"

namespace plumbline::effects {
namespace {

struct StepEventFormula {
  enum Parameter { kTime, kRow, kX };

  static EffectTraits Traits() {
    return {
        .id = "step_event",
        .meaning = "something moved at one time: a slip, a collision, an exchanged tool",
        .remedy =
            "find out what happened at that time; fasten the part, and align or calibrate again",
        .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                       {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                       {"x", "mm", 1e-3, {-10, 10}},
                       {"y", "mm", 1e-3, {-10, 10}},
                       {"z", "mm", 1e-3, {-10, 10}},
                       {.name = "frame", .role = ParameterRole::kWord, .words = "base,tool"}},
        .needs = {},
        .confused_with = {"thermal_drift", "base_frame", "tool_frame", "thermal_growth",
                          "tilt_event"},
        .name = "a step at one time"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!HasHappened(term, values, conditions)) return;
    const int first = term.word == "tool" ? Influence<T>::kTip : Influence<T>::kBase;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec >= kX) influence[first + spec - kX] += values[k];
    }
  }
};

}  // namespace

const Effect& StepEvent() {
  static const EffectOf<StepEventFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
