#include "firmware-like/effects/camera_frame.h"

namespace plumbline::effects {
namespace {

struct CameraFrameFormula {
  /// The named cameras, and the means of two.
  static constexpr std::string_view kCameras =
      "side,rear,front,top,side+rear,side+front,side+top,rear+front,rear+top,front+top";

  static EffectTraits Traits() {
    return {.id = "camera_frame",
            .meaning = "one camera measures with another pose or scale than the others",
            .remedy =
                "calibrate the lens of that camera again and check its view of the reference "
                "tags; do not correct the robot for it",
            .parameters = {{"x", "mm", 1e-3, {-20, 20}},
                           {"y", "mm", 1e-3, {-20, 20}},
                           {"z", "mm", 1e-3, {-20, 20}},
                           {"roll", "deg", kRadPerDeg, {-1, 1}},
                           {"pitch", "deg", kRadPerDeg, {-1, 1}},
                           {"yaw", "deg", kRadPerDeg, {-1, 1}},
                           {"scale", "1", 1, {-1e-2, 1e-2}},
                           {.name = "camera", .role = ParameterRole::kWord, .words = kCameras}},
            .needs = {Signal::kCameras},
            .confused_with = {"base_frame", "measurement_scale", "camera_tag_size"},
            .independent_parameters = true,
            .name = "frame of one camera",
            .of_one_camera = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (conditions.camera_name.empty() || conditions.camera_name != term.word) return;
    constexpr int kRoll = 3, kYaw = 5;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec < kRoll) {
        influence[Influence<T>::kBase + spec] += values[k];
      } else if (spec < kYaw) {
        // Gravity rotates with the base, so that only the reading changes.
        influence[Influence<T>::kBaseTilt + spec - kRoll] += values[k];
        influence[Influence<T>::kGravityTurnX + spec - kRoll] += values[k];
      } else if (spec == kYaw) {
        influence[Influence<T>::kBaseRollPitchYaw + 2] += values[k];
      } else {
        influence[Influence<T>::kScale] += values[k];
      }
    }
  }
};

}  // namespace

const Effect& CameraFrame() {
  static const EffectOf<CameraFrameFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
