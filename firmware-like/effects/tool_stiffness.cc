#include "firmware-like/effects/tool_stiffness.h"

namespace plumbline {
namespace {

struct ToolStiffnessFormula {
  static EffectTraits Traits() {
    return {
        .id = "tool_stiffness",
        .meaning = "the tool's bending stiffness differs from the declared one",
        .remedy =
            "check section, wall and modulus of the tool in cell.toml; a sudden fall is a crack",
        .parameters = {{"ratio", "1", 1, {-0.6, 1.5}}},
        .needs = {Signal::kBeam},
        .confused_with = {"payload_mass", "payload_cog", "tool_root_compliance", "tool_shear",
                          "tool_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    // A tool of E I (1 + ratio) bends by 1/(1 + ratio): what acts is linear in the bending.
    for (const T& ratio : values) {
      influence[Influence<T>::kBendRatio] += 1.0 / (1.0 + ratio) - 1.0;
    }
  }
};

}  // namespace

const Effect& ToolStiffness() {
  static const EffectOf<ToolStiffnessFormula> effect;
  return effect;
}

}  // namespace plumbline
