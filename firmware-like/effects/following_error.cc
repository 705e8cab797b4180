#include "firmware-like/effects/following_error.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct FollowingErrorFormula {
  static EffectTraits Traits() {
    return {.id = "following_error",
            .meaning =
                "the joint stops short of its command in proportion to its speed in the last move",
            .remedy =
                "wait longer after a move, or increase the gain of the position loop; measure at "
                "production speed",
            .parameters = {{.name = "q#",
                            .unit = "rad",
                            .plausible = {-5e-3, 5e-3},
                            .prismatic_unit = "m",
                            .prismatic_plausible = {-5e-3, 5e-3}}},
            .needs = {Signal::kOrder},
            .confused_with = {"approach_lag", "backlash", "arrival_friction", "latency"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -ShareOfMove(conditions, joint); });
  }
};

}  // namespace

const Effect& FollowingError() {
  static const EffectOf<FollowingErrorFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
