#include "firmware-like/effects/dynamic_inertia.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct DynamicInertiaFormula {
  static EffectTraits Traits() {
    return {.id = "dynamic_inertia",
            .meaning = "the joint winds up under the inertia of what it accelerates",
            .remedy = "measure at standstill, or lower the acceleration near the point",
            .parameters = {{"q#", "s^2", 1, {0, 3e-3}}},
            .needs = {Signal::kAcceleration},
            .confused_with = {"latency", "joint_compliance", "approach_lag"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -OfJoint(conditions.qdd, joint); });
  }
};

}  // namespace

const Effect& DynamicInertia() {
  static const EffectOf<DynamicInertiaFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
