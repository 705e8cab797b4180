#include "firmware-like/effects/tool_root_compliance.h"

namespace plumbline::effects {
namespace {

struct ToolRootComplianceFormula {
  static EffectTraits Traits() {
    return {.id = "tool_root_compliance",
            .meaning = "the tool's seat on the flange tilts under load",
            .remedy =
                "check the flange screws and the tool changer's wear; otherwise let the correction "
                "compensate for it",
            .parameters = {{"compliance", "rad/(N m)", 1, {0, 1e-4}}},
            .needs = {},
            .confused_with = {"tool_stiffness", "payload_cog", "payload_mass", "tool_shear",
                              "joint_compliance"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (const T& compliance : values) influence[Influence<T>::kRootCompliance] += compliance;
  }
};

}  // namespace

const Effect& ToolRootCompliance() {
  static const EffectOf<ToolRootComplianceFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
