#include "firmware-like/effects/gear_periodic.h"

#include <numbers>

namespace plumbline::effects {
namespace {

struct GearPeriodicFormula {
  enum Parameter { kAmplitude, kCycles, kPhase, kOfOneTerm };
  static constexpr model::Interval kCircle{-std::numbers::pi, std::numbers::pi};
  // No wheel of a gear train turns slower than its joint. Below half a cycle per turn, a sine is
  // indistinguishable from an offset and a slope.
  static constexpr model::Interval kCycleRange{0.5, 400};

  static ParameterSpec Amplitude(std::string_view name) {
    return {.name = name,
            .unit = "rad",
            .plausible = {-2e-3, 2e-3},
            .prismatic_unit = "m",
            .prismatic_plausible = {-2e-3, 2e-3}};
  }
  /// For a prismatic joint: 2 pi divided by the period [rad/m].
  static ParameterSpec Cycles(std::string_view name) {
    return {.name = name,
            .unit = "1/turn",
            .plausible = kCycleRange,
            .role = ParameterRole::kShape,
            .prismatic_unit = "rad/m",
            .prismatic_plausible = kCycleRange};
  }

  static EffectTraits Traits() {
    return {.id = "gear_periodic",
            .meaning = "the joint's error repeats with its angle: gear, encoder or bearing",
            .remedy =
                "a property of gear or encoder: let the correction compensate for it; an increase "
                "indicates wear",
            .parameters = {Amplitude("q#_amplitude"),
                           Cycles("q#_cycles"),
                           {"q#_phase", "rad", 1, kCircle, ParameterRole::kShape},
                           Amplitude("q#_#_amplitude"),
                           Cycles("q#_#_cycles"),
                           {"q#_#_phase", "rad", 1, kCircle, ParameterRole::kShape}},
            .needs = {},
            .confused_with = {"counterbalance", "gear_ratio", "joint_offset", "joint_compliance"},
            .per_joint = true,
            .name = "periodic gear error"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    using std::sin;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.spec % kOfOneTerm != kAmplitude) continue;
      const T cycles = ValueOfSame(term, values, k, parameter.spec + kCycles, T(1));
      const T phase = ValueOfSame(term, values, k, parameter.spec + kPhase, T(0));
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * sin(cycles * conditions.q[parameter.joint] + phase);
    }
  }
};

}  // namespace

const Effect& GearPeriodic() {
  static const EffectOf<GearPeriodicFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
