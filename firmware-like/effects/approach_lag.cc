#include "firmware-like/effects/approach_lag.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct ApproachLagFormula {
  static EffectTraits Traits() {
    return {.id = "approach_lag",
            .meaning = "the joint is measured before it has fully arrived",
            .remedy = "wait longer after a move, or tighten the controller's in-position window",
            .parameters = {{"q#", "1", 1, {-0.005, 0.02}}},
            .needs = {Signal::kOrder},
            .confused_with = {"backlash", "latency", "gear_ratio"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -OfJoint(conditions.last_move, joint); });
  }
};

}  // namespace

const Effect& ApproachLag() {
  static const EffectOf<ApproachLagFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
