#include "firmware-like/effects/camera_tag_size.h"

namespace plumbline::effects {
namespace {

struct CameraTagSizeFormula {
  static EffectTraits Traits() {
    return {.id = "camera_tag_size",
            .meaning = "the tags are not as large as configured",
            .remedy =
                "measure a tag's black border with a calliper and correct the size in the "
                "camera's configuration; do not correct the robot for it",
            .parameters = {{"scale", "1", 1, {-0.3, 0.3}}},
            .needs = {Signal::kCamera},
            .confused_with = {"measurement_scale", "camera_zoom", "link_geometry"},
            .name = "a wrong tag size"};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    for (const T& scale : values) influence[Influence<T>::kCameraScale] += scale;
  }
};

}  // namespace

const Effect& CameraTagSize() {
  static const EffectOf<CameraTagSizeFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
