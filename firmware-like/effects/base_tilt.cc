#include "firmware-like/effects/base_tilt.h"

namespace plumbline::effects {
namespace {

struct BaseTiltFormula {
  static EffectTraits Traits() {
    return {.id = "base_tilt",
            .meaning = "the base tilts as its inclinometer reads",
            .remedy =
                "find out what tilts it: the floor, the anchor bolts, a press beside it; with a "
                "permanent inclinometer, let the correction compensate for it",
            .parameters = {{"gain", "1", 1, {-2, 2}}},
            .needs = {Signal::kTilt},
            .confused_with = {"tilt_event", "thermal_drift", "pedestal_compliance", "base_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    const auto about_x = conditions.Signal("tilt_x_deg"), about_y = conditions.Signal("tilt_y_deg");
    if (!about_x || !about_y) return;
    for (const T& gain : values) {
      influence[Influence<T>::kBaseTilt] += gain * (*about_x * kRadPerDeg);
      influence[Influence<T>::kBaseTilt + 1] += gain * (*about_y * kRadPerDeg);
    }
  }
};

}  // namespace

const Effect& BaseTilt() {
  static const EffectOf<BaseTiltFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
