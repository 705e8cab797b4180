#include "firmware-like/effects/latency.h"

namespace plumbline::effects {
namespace {

struct LatencyFormula {
  static EffectTraits Traits() {
    return {.id = "latency",
            .meaning = "the arm is measured at another time than its joints are read",
            .remedy = "synchronise instrument and controller, or measure at standstill",
            .parameters = {{"time", "s", 1, {-0.2, 0.5}}},
            .needs = {Signal::kVelocity},
            .confused_with = {"approach_lag", "backlash", "dynamic_inertia"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (const T& time_s : values) {
      for (int joint = 0; joint < conditions.qd.size(); ++joint) {
        influence.Joint(Influence<T>::kTurn, joint) -= time_s * conditions.qd[joint];
      }
    }
  }
};

}  // namespace

const Effect& Latency() {
  static const EffectOf<LatencyFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
