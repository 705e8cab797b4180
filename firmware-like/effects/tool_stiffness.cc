#include "firmware-like/effects/tool_stiffness.h"

#include <algorithm>

namespace plumbline::effects {
namespace {

/// The ratio for a relative change of the bending: 1/(1 + ratio) = 1 - linear, limited to a
/// twentieth of the stiffness.
double RatioFromBending(double linear) {
  constexpr double kSoftest = 0.05;
  return 1 / std::max(kSoftest, 1 - linear) - 1;
}

struct ToolStiffnessFormula {
  static EffectTraits Traits() {
    return {.id = "tool_stiffness",
            .meaning = "the tool's bending stiffness differs from the declared one",
            .remedy =
                "check section, wall and modulus of the tool in cell.toml; a sudden drop indicates "
                "a crack",
            .parameters = {{.name = "ratio",
                            .unit = "1",
                            .plausible = {-0.6, 1.5},
                            .value_of_linear = RatioFromBending}},
            .needs = {Signal::kBeam},
            .confused_with = {"payload_mass", "payload_cog", "tool_root_compliance", "tool_shear",
                              "tool_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    // A tool with E I (1 + ratio) bends by a factor of 1/(1 + ratio).
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

}  // namespace plumbline::effects
