#include "firmware-like/effects/pedestal_compliance.h"

namespace plumbline::effects {
namespace {

struct PedestalComplianceFormula {
  static EffectTraits Traits() {
    return {
        .id = "pedestal_compliance",
        .meaning = "the pedestal or the floor tilts as the arm reaches out",
        .remedy =
            "check the anchor bolts and the grout; otherwise let the correction compensate for it",
        .parameters = {{"compliance", "rad/(N m)", 1, {0, 1e-5}}},
        .needs = {Signal::kWeight},
        .confused_with = {"joint_compliance", "base_frame", "gravity_direction", "link_geometry",
                          "bearing_tilt", "link_bending"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (const T& compliance : values) influence[Influence<T>::kPedestalCompliance] += compliance;
  }
};

}  // namespace

const Effect& PedestalCompliance() {
  static const EffectOf<PedestalComplianceFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
