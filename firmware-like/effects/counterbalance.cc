#include "firmware-like/effects/counterbalance.h"

#include <numbers>

namespace plumbline::effects {
namespace {

struct CounterbalanceFormula {
  enum Parameter { kAmplitude, kPhase };
  static constexpr model::Interval kCircle{-std::numbers::pi, std::numbers::pi};

  static EffectTraits Traits() {
    return {.id = "counterbalance",
            .meaning = "a balancing spring or cylinder loads the joint",
            .remedy =
                "check the cylinder's pressure or the spring; let the correction compensate for a "
                "constant one",
            .parameters = {{"q#_amplitude", "N m", 1, {-1e4, 1e4}},
                           {"q#_phase", "rad", 1, kCircle, ParameterRole::kShape}},
            .needs = {},
            .confused_with = {"gear_periodic", "joint_compliance", "gear_ratio", "payload_mass"},
            .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    using std::sin;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec != kAmplitude) continue;
      const int joint = term.parameters[k].joint;
      const T phase = ValueOfSame(term, values, k, kPhase, T(0));
      influence.Joint(Influence<T>::kTorque, joint) += values[k] * sin(conditions.q[joint] + phase);
    }
  }
};

}  // namespace

const Effect& Counterbalance() {
  static const EffectOf<CounterbalanceFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
