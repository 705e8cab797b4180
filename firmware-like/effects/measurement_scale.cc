#include "firmware-like/effects/measurement_scale.h"

namespace plumbline::effects {
namespace {

struct MeasurementScaleFormula {
  static EffectTraits Traits() {
    return {.id = "measurement_scale",
            .meaning = "the instrument's scale is wrong",
            .remedy =
                "calibrate the instrument against a known length; do not correct the robot for it",
            .parameters = {{"scale", "1", 1, {-2e-3, 2e-3}}},
            .needs = {},
            .confused_with = {"link_geometry", "thermal_growth"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (const T& scale : values) influence[Influence<T>::kScale] += scale;
  }
};

}  // namespace

const Effect& MeasurementScale() {
  static const EffectOf<MeasurementScaleFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
