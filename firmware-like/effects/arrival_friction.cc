#include "firmware-like/effects/arrival_friction.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct ArrivalFrictionFormula {
  static EffectTraits Traits() {
    return {.id = "arrival_friction",
            .meaning = "friction that grows with the load holds the joint short of its command",
            .remedy =
                "approach from one side; check lubrication and preload if it grows; otherwise let "
                "the correction compensate for it",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)",
                            .plausible = {-5e-5, 2e-4},
                            .prismatic_unit = "m/N",
                            .prismatic_plausible = {-5e-5, 2e-4}}},
            .needs = {Signal::kOrder, Signal::kTorques},
            .confused_with = {"following_error", "backlash", "approach_lag", "joint_compliance"},
            .per_joint = true,
            // As lost motion and hysteresis: 2 arcmin (backlash).
            .largest_observed_rotation_rad = 6e-4,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kLoadShare, term, values, influence,
                   [&](int joint) { return -ShareOfMove(conditions, joint); });
  }
};

}  // namespace

const Effect& ArrivalFriction() {
  static const EffectOf<ArrivalFrictionFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
