#include "firmware-like/effects/camera_zoom.h"

namespace plumbline::effects {
namespace {

struct CameraZoomFormula {
  enum Parameter { kTime, kRow, kScale };

  static EffectTraits Traits() {
    return {.id = "camera_zoom",
            .meaning = "the camera was zoomed or focused but measures with its old focal length",
            .remedy =
                "calibrate the lens at this zoom, or zoom back, and measure again; do not "
                "correct the robot for it",
            .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                           {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                           {"scale", "1", 1, {-0.3, 0.3}}},
            .needs = {Signal::kCamera},
            .confused_with = {"camera_tag_size", "camera_lens", "measurement_scale", "step_event"},
            .name = "an uncorrected zoom change"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    bool waits = false, begun = false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec == kTime) begun = begun || (conditions.t_s && *conditions.t_s >= values[k]);
      if (spec == kRow) begun = begun || (conditions.row && *conditions.row >= values[k]);
      waits = waits || spec == kTime || spec == kRow;
    }
    if (waits && !begun) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec == kScale) influence[Influence<T>::kCameraDepth] += values[k];
    }
  }
};

}  // namespace

const Effect& CameraZoom() {
  static const EffectOf<CameraZoomFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
