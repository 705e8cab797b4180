#include "firmware-like/effects/link_bending.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct LinkBendingFormula {
  static EffectTraits Traits() {
    return {.id = "link_bending",
            .meaning = "a link bends or twists under the weight that it carries",
            .remedy = "a property of the arm's structure: let the correction compensate for it",
            .parameters = {{"q#", "rad/(N m)", 1, {0, 2e-5}},
                           {"q#_torsion", "rad/(N m)", 1, {0, 2e-5}}},
            .needs = {Signal::kWeight},
            .confused_with = {"joint_compliance", "bearing_tilt", "pedestal_compliance",
                              "link_geometry", "tool_stiffness"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kLinkBending, Influence<T>::kLinkTorsion}, term, values,
                   influence);
  }
};

}  // namespace

const Effect& LinkBending() {
  static const EffectOf<LinkBendingFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
