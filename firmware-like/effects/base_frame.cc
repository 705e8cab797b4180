#include "firmware-like/effects/base_frame.h"

namespace plumbline::effects {
namespace {

struct BaseFrameFormula {
  static EffectTraits Traits() {
    return {
        .id = "base_frame",
        .meaning = "the robot's base is not where it was declared",
        .remedy = "align the instrument to the base again, or correct base_xyz_mm and base_rpy_deg",
        .parameters = {{"x", "mm", 1e-3, {-20, 20}},
                       {"y", "mm", 1e-3, {-20, 20}},
                       {"z", "mm", 1e-3, {-20, 20}},
                       {"roll", "deg", kRadPerDeg, {-2, 2}},
                       {"pitch", "deg", kRadPerDeg, {-2, 2}},
                       {"yaw", "deg", kRadPerDeg, {-2, 2}}},
        .needs = {},
        .confused_with = {"joint_offset", "link_geometry", "gravity_direction",
                          "pedestal_compliance", "thermal_drift", "step_event", "tool_frame"},
        .nuisance = Nuisance::kBaseFrame};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    constexpr int kFirstAngle = 3;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int axis = term.parameters[k].spec;
      const int entry = axis < kFirstAngle ? Influence<T>::kBase + axis
                                           : Influence<T>::kBaseRollPitchYaw + axis - kFirstAngle;
      influence[entry] += values[k];
    }
  }
};

}  // namespace

const Effect& BaseFrame() {
  static const EffectOf<BaseFrameFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
