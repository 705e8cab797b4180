#include "firmware-like/effects/joint_offset.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct JointOffsetFormula {
  static EffectTraits Traits() {
    return {
        .id = "joint_offset",
        .meaning = "the joint's zero position is off",
        .remedy = "master the joint again, or let the correction compensate for the offset",
        .parameters = {{.name = "q#",
                        .unit = "rad",
                        .plausible = {-0.02, 0.02},
                        .prismatic_unit = "m",
                        .prismatic_plausible = {-0.02, 0.02}}},
        .needs = {},
        .confused_with = {"backlash", "gear_ratio", "link_geometry", "base_frame", "tool_frame"},
        .per_joint = true,
        .of_arm = true,
        .zero_mean_over_arms = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kTurn}, term, values, influence);
  }
};

}  // namespace

const Effect& JointOffset() {
  static const EffectOf<JointOffsetFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
