#include "firmware-like/effects/tool_shear.h"

namespace plumbline::effects {
namespace {

struct ToolShearFormula {
  static EffectTraits Traits() {
    return {
        .id = "tool_shear",
        .meaning = "the tool shears under the payload, in addition to bending",
        .remedy = "declare the tool with model = \"timoshenko\"",
        .parameters = {{.name = "kappa", .unit = "1", .plausible = {0.2, 1.2}, .inverse = true}},
        .needs = {Signal::kBeam, Signal::kPayload},
        .confused_with = {"tool_stiffness", "payload_mass", "tool_root_compliance"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (const T& inverse_kappa : values) influence[Influence<T>::kShear] += inverse_kappa;
  }
};

}  // namespace

const Effect& ToolShear() {
  static const EffectOf<ToolShearFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
