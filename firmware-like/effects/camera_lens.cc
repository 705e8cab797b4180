#include "firmware-like/effects/camera_lens.h"

namespace plumbline::effects {
namespace {

struct CameraLensFormula {
  static EffectTraits Traits() {
    return {.id = "camera_lens",
            .meaning = "the lens distortion has changed since calibration",
            .remedy =
                "calibrate the lens at this zoom and focus, and measure again; do not correct "
                "the robot for it",
            .parameters = {{"k1", "1", 1, {-0.5, 0.5}}},
            .needs = {Signal::kCamera},
            .confused_with = {"camera_zoom", "camera_tag_size", "measurement_scale"},
            .name = "a stale lens"};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    for (const T& k1 : values) influence[Influence<T>::kCameraRadial] += k1;
  }
};

}  // namespace

const Effect& CameraLens() {
  static const EffectOf<CameraLensFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
