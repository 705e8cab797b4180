#include "firmware-like/effects/payload_mass.h"

namespace plumbline::effects {
namespace {

struct PayloadMassFormula {
  enum Parameter { kScale, kConstant };

  static EffectTraits Traits() {
    return {
        .id = "payload_mass",
        .meaning = "the payload weighs more or less than the program says",
        .remedy = "weigh the load, and look for a gripper, a hose or a cable that was not entered",
        .parameters = {{"scale", "1", 1, {-0.3, 0.3}}, {"constant", "kg", 1, {-20, 20}}},
        .needs = {Signal::kPayload},
        .confused_with = {"tool_stiffness", "joint_compliance", "payload_cog",
                          "tool_root_compliance", "gravity_direction"},
        .independent_parameters = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double per_unit = term.parameters[k].spec == kScale ? conditions.payload_kg : 1.0;
      influence[Influence<T>::kPayloadMass] += values[k] * per_unit;
    }
  }
};

}  // namespace

const Effect& PayloadMass() {
  static const EffectOf<PayloadMassFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
