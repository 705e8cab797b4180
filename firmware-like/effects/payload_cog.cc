#include "firmware-like/effects/payload_cog.h"

namespace plumbline::effects {
namespace {

struct PayloadCogFormula {
  static EffectTraits Traits() {
    return {
        .id = "payload_cog",
        .meaning = "the payload's centre of gravity is elsewhere than declared",
        .remedy = "check cog_mm of the payload in cell.toml, and how the part sits in the gripper",
        .parameters = {{"x", "mm", 1e-3, {-150, 150}},
                       {"y", "mm", 1e-3, {-150, 150}},
                       {"z", "mm", 1e-3, {-150, 150}}},
        .needs = {Signal::kPayload},
        .confused_with = {"payload_mass", "tool_root_compliance", "tool_stiffness", "tool_frame",
                          "joint_compliance"}};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      influence[Influence<T>::kPayloadCog + term.parameters[k].spec] += values[k];
    }
  }
};

}  // namespace

const Effect& PayloadCog() {
  static const EffectOf<PayloadCogFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
