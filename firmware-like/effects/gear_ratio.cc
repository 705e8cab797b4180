#include "firmware-like/effects/gear_ratio.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct GearRatioFormula {
  static EffectTraits Traits() {
    return {.id = "gear_ratio",
            .meaning = "the joint turns by a constant fraction more or less than commanded",
            .remedy =
                "check the joint's gear ratio in the controller; otherwise let the correction "
                "compensate for it",
            .parameters = {{"q#", "1", 1, {-5e-3, 5e-3}}},
            .needs = {},
            .confused_with = {"joint_offset", "gear_periodic", "counterbalance", "link_geometry",
                              "approach_lag"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return conditions.q[joint]; });
  }
};

}  // namespace

const Effect& GearRatio() {
  static const EffectOf<GearRatioFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
