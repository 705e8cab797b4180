#include "firmware-like/effects/link_geometry.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct LinkGeometryFormula {
  static EffectTraits Traits() {
    return {.id = "link_geometry",
            .meaning = "the arm's links differ from the declared DH table",
            .remedy =
                "a property of this arm: let the correction compensate for it; a sudden change "
                "indicates a collision",
            .parameters = {{"a#", "mm", 1e-3, {-5, 5}},
                           {"d#", "mm", 1e-3, {-5, 5}},
                           {"alpha#", "deg", kRadPerDeg, {-0.5, 0.5}},
                           {.name = "beta#",
                            .unit = "deg",
                            .to_SI = kRadPerDeg,
                            .plausible = {-0.5, 0.5},
                            .parallel_axes_only = true}},
            .needs = {},
            .confused_with = {"joint_offset", "thermal_growth", "measurement_scale", "base_frame",
                              "tool_frame", "joint_compliance"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kLengthA, Influence<T>::kOffsetD, Influence<T>::kTwistAlpha,
                    Influence<T>::kTwistBeta},
                   term, values, influence);
  }
};

}  // namespace

const Effect& LinkGeometry() {
  static const EffectOf<LinkGeometryFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
