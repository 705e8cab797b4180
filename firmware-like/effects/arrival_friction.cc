#include "firmware-like/effects/arrival_friction.h"

namespace plumbline::effects {
namespace {

struct ArrivalFrictionFormula {
  static EffectTraits Traits() {
    return {.id = "arrival_friction",
            .meaning = "friction that grows with the load holds the joint short of its command",
            .remedy =
                "approach from one side; check lubrication and preload if it grows; otherwise let "
                "the correction compensate for it",
            .parameters = {{"q#", "rad/(N m)", 1, {-5e-5, 2e-4}}},
            .needs = {Signal::kOrder, Signal::kTorques},
            .confused_with = {"following_error", "backlash", "approach_lag", "joint_compliance"},
            .per_joint = true,
            // As lost motion and hysteresis: 2 arcmin (backlash).
            .seen_turn_rad = 6e-4};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int joint = term.parameters[k].joint;
      influence.Joint(Influence<T>::kLoadShare, joint) -=
          values[k] * ShareOfMove(conditions, joint);
    }
  }
};

}  // namespace

const Effect& ArrivalFriction() {
  static const EffectOf<ArrivalFrictionFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
