#include "firmware-like/effects/gravity_direction.h"

namespace plumbline::effects {
namespace {

struct GravityDirectionFormula {
  static EffectTraits Traits() {
    return {.id = "gravity_direction",
            .meaning = "the measurement frame is not level",
            .remedy = "level the instrument, or enter gravity_m_s2 in the measurement frame",
            .parameters = {{"x", "rad", 1, {-0.035, 0.035}}, {"y", "rad", 1, {-0.035, 0.035}}},
            .needs = {},
            .confused_with = {"base_frame", "pedestal_compliance", "payload_mass", "payload_cog"}};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      influence[Influence<T>::kGravityTurnX + term.parameters[k].spec] += values[k];
    }
  }
};

}  // namespace

const Effect& GravityDirection() {
  static const EffectOf<GravityDirectionFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
