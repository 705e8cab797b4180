#include "firmware-like/effects/thermal_drift.h"

namespace plumbline::effects {
namespace {

struct ThermalDriftFormula {
  static constexpr int kTimeConstant = 3;

  static EffectTraits Traits() {
    return {.id = "thermal_drift",
            .meaning = "the base, or the instrument, moves as the cell warms up",
            .remedy = "warm up the cell before work, or measure a fixed reference between parts",
            .parameters = {{"x", "mm", 1e-3, {-3, 3}},
                           {"y", "mm", 1e-3, {-3, 3}},
                           {"z", "mm", 1e-3, {-3, 3}},
                           {"time_constant", "s", 1, {10, 1e6}, ParameterRole::kShape}},
            .needs = {Signal::kTime},
            .confused_with = {"thermal_growth", "step_event", "base_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.t_s) return;
    using std::exp;
    T warmth(0);
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec == kTimeConstant)
        warmth = 1.0 - exp(-*conditions.t_s / values[k]);
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int axis = term.parameters[k].spec;
      if (axis != kTimeConstant) influence[Influence<T>::kBase + axis] += values[k] * warmth;
    }
  }
};

}  // namespace

const Effect& ThermalDrift() {
  static const EffectOf<ThermalDriftFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
