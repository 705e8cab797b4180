#include "firmware-like/effects/approach_lag.h"

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
            .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int joint = term.parameters[k].joint;
      if (conditions.last_move.size() <= joint) continue;
      influence.Joint(Influence<T>::kTurn, joint) -= values[k] * conditions.last_move[joint];
    }
  }
};

}  // namespace

const Effect& ApproachLag() {
  static const EffectOf<ApproachLagFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
