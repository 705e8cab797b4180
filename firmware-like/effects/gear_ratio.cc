#include "firmware-like/effects/gear_ratio.h"

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
            .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int joint = term.parameters[k].joint;
      influence.Joint(Influence<T>::kTurn, joint) += values[k] * conditions.q[joint];
    }
  }
};

}  // namespace

const Effect& GearRatio() {
  static const EffectOf<GearRatioFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
