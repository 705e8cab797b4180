#include "firmware-like/effects/tool_frame.h"

namespace plumbline::effects {
namespace {

struct ToolFrameFormula {
  static EffectTraits Traits() {
    return {.id = "tool_frame",
            .meaning = "the tool tip is not where it was declared on the flange",
            .remedy =
                "calibrate the tool centre point again, and check for a bent or badly seated tool",
            .parameters = {{"x", "mm", 1e-3, {-10, 10}},
                           {"y", "mm", 1e-3, {-10, 10}},
                           {"z", "mm", 1e-3, {-10, 10}}},
            .needs = {},
            .confused_with = {"joint_offset", "link_geometry", "payload_cog", "step_event",
                              "base_frame"},
            .nuisance = Nuisance::kToolFrame};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      influence[Influence<T>::kTip + term.parameters[k].spec] += values[k];
    }
  }
};

}  // namespace

const Effect& ToolFrame() {
  static const EffectOf<ToolFrameFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
