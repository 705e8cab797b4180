#include "firmware-like/effects/range_zero.h"

namespace plumbline::effects {
namespace {

struct RangeZeroFormula {
  static EffectTraits Traits() {
    return {.id = "range_zero",
            .meaning = "every range is too long or too short by the same length",
            .remedy =
                "check the wire's length at its zero, or the prism constant; do not correct the "
                "robot for it",
            .parameters = {{"zero", "mm", 1e-3, {-50, 50}}},
            .needs = {Signal::kRange},
            .confused_with = {"range_anchor", "measurement_scale", "base_frame", "tool_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (const T& zero : values) influence[Influence<T>::kRangeZero] += zero;
  }
};

}  // namespace

const Effect& RangeZero() {
  static const EffectOf<RangeZeroFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
