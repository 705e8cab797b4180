#include "firmware-like/effects/backlash.h"

namespace plumbline::effects {
namespace {

struct BacklashFormula {
  static EffectTraits Traits() {
    return {.id = "backlash",
            .meaning = "the joint's gearbox has play",
            .remedy = "approach from one side; have the gearbox adjusted if the gap grows",
            .parameters = {{.name = "q#",
                            .unit = "rad",
                            .plausible = {-2e-3, 2e-3},
                            .prismatic_unit = "m",
                            .prismatic_plausible = {-2e-3, 2e-3},
                            .not_negative_with = "load"},
                           {.name = "by", .role = ParameterRole::kWord, .words = "load,move"}},
            .needs = {},
            .word_needs = {{"load", Signal::kTorques}, {"move", Signal::kOrder}},
            .confused_with = {"joint_offset", "approach_lag", "joint_compliance", "joint_hardening",
                              "latency"},
            .per_joint = true,
            // Lost motion and hysteresis: below 1 arcmin for cycloidal gears [Nabtesco RV
            // catalogue], 1 to 2 for strain wave gears [Harmonic Drive]. 2 arcmin.
            .largest_observed_rotation_rad = 6e-4,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    const bool by_move = term.word == "move";
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int joint = term.parameters[k].joint;
      if (!by_move) {
        influence.Joint(Influence<T>::kLoadGap, joint) += values[k];
      } else if (conditions.approach.size() > joint) {
        influence.Joint(Influence<T>::kTurn, joint) += values[k] * conditions.approach[joint];
      }
    }
  }
};

}  // namespace

const Effect& Backlash() {
  static const EffectOf<BacklashFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
