#include "firmware-like/effects/axis_coupling.h"

namespace plumbline::effects {
namespace {

struct AxisCouplingFormula {
  static EffectTraits Traits() {
    return {.id = "axis_coupling",
            .meaning = "the joint turns slightly along with another one, through shared gears",
            .remedy =
                "check the coupling ratio of these axes in the controller; otherwise let the "
                "correction compensate for it",
            .parameters = {{"q#_of_q#", "1", 1, {-0.02, 0.02}}},
            .needs = {},
            .confused_with = {"gear_ratio", "joint_offset", "link_geometry", "gear_periodic"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.of < 0) continue;
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * conditions.q[parameter.of];
    }
  }
};

}  // namespace

const Effect& AxisCoupling() {
  static const EffectOf<AxisCouplingFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
