#include "firmware-like/effects/bearing_tilt.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct BearingTiltFormula {
  static EffectTraits Traits() {
    return {
        .id = "bearing_tilt",
        .meaning = "a joint's bearing tilts under the weight that it carries",
        .remedy =
            "a property of the bearing: let the correction compensate for it; a sudden increase "
            "indicates a worn or loose bearing",
        .parameters = {{.name = "q#",
                        .unit = "rad/(N m)",
                        .plausible = {0, 2e-5},
                        .only = model::JointType::kRevolute,
                        .not_of_first = true}},
        .needs = {Signal::kWeight},
        .confused_with = {"link_bending", "joint_compliance", "pedestal_compliance",
                          "link_geometry", "payload_cog", "tool_root_compliance", "tool_stiffness"},
        .per_joint = true,
        .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kBearing}, term, values, influence);
  }
};

}  // namespace

const Effect& BearingTilt() {
  static const EffectOf<BearingTiltFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
