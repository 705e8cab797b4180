#include "firmware-like/effects/thermal_growth.h"

namespace plumbline {
namespace {

struct ThermalGrowthFormula {
  static EffectTraits Traits() {
    return {.id = "thermal_growth",
            .meaning = "the arm's links grow with the temperature",
            .remedy = "give the daemon the temperature, or keep the cell's constant",
            .parameters = {{"alpha", "1/K", 1, {0, 4e-5}}},
            .needs = {Signal::kTemperature},
            .confused_with = {"thermal_drift", "link_geometry", "measurement_scale"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.temp_C || !conditions.reference_temperature_C) return;
    const double warmer_K = *conditions.temp_C - *conditions.reference_temperature_C;
    for (const T& alpha : values) {
      for (int joint = 0; joint < conditions.a_m.size(); ++joint) {
        influence.Joint(Influence<T>::kLengthA, joint) +=
            alpha * (warmer_K * conditions.a_m[joint]);
        influence.Joint(Influence<T>::kOffsetD, joint) +=
            alpha * (warmer_K * conditions.d_m[joint]);
      }
    }
  }
};

}  // namespace

const Effect& ThermalGrowth() {
  static const EffectOf<ThermalGrowthFormula> effect;
  return effect;
}

}  // namespace plumbline
