#include "firmware-like/effects/thermal_growth.h"

namespace plumbline::effects {
namespace {

struct ThermalGrowthFormula {
  static EffectTraits Traits() {
    return {
        .id = "thermal_growth",
        .meaning = "the arm's links expand with temperature",
        .remedy = "provide the temperature to the daemon, or keep the cell's temperature constant",
        .parameters = {{"alpha", "1/K", 1, {0, 4e-5}}},
        .needs = {Signal::kTemperature},
        .confused_with = {"thermal_drift", "link_geometry", "measurement_scale"},
        .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.temp_C || !conditions.reference_temperature_C || !conditions.robot) return;
    const double warmer_K = *conditions.temp_C - *conditions.reference_temperature_C;
    for (const T& alpha : values) {
      int joint = 0;
      for (const model::Joint& link : conditions.robot->joints) {
        influence.Joint(Influence<T>::kLengthA, joint) += alpha * (warmer_K * link.a_m);
        influence.Joint(Influence<T>::kOffsetD, joint) += alpha * (warmer_K * link.d_m);
        ++joint;
      }
    }
  }
};

}  // namespace

const Effect& ThermalGrowth() {
  static const EffectOf<ThermalGrowthFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
