#include "firmware-like/effects/range_anchor.h"

namespace plumbline::effects {
namespace {

struct RangeAnchorFormula {
  static EffectTraits Traits() {
    return {.id = "range_anchor",
            .meaning = "the anchor of the ranges is not where it was declared",
            .remedy = "measure the position of the anchor and correct anchor_mm",
            .parameters = {{"x", "mm", 1e-3, {-50, 50}},
                           {"y", "mm", 1e-3, {-50, 50}},
                           {"z", "mm", 1e-3, {-50, 50}}},
            .needs = {Signal::kRange},
            .confused_with = {"range_zero", "base_frame", "tool_frame", "measurement_scale"}};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      influence[Influence<T>::kRangeAnchor + term.parameters[k].spec] += values[k];
    }
  }
};

}  // namespace

const Effect& RangeAnchor() {
  static const EffectOf<RangeAnchorFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
