#include "firmware-like/effects/joint_offset.h"

namespace plumbline::effects {
namespace {

struct JointOffsetFormula {
  static EffectTraits Traits() {
    return {
        .id = "joint_offset",
        .meaning = "the joint's zero position is off",
        .remedy = "master the joint again, or let the correction compensate for the offset",
        .parameters = {{"q#", "rad", 1, {-0.02, 0.02}}},
        .needs = {},
        .confused_with = {"backlash", "gear_ratio", "link_geometry", "base_frame", "tool_frame"},
        .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      influence.Joint(Influence<T>::kTurn, term.parameters[k].joint) += values[k];
    }
  }
};

}  // namespace

const Effect& JointOffset() {
  static const EffectOf<JointOffsetFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
