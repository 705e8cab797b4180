#include "firmware-like/effects/axis_bending.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct AxisBendingFormula {
  static EffectTraits Traits() {
    return {.id = "axis_bending",
            .meaning = "an extending axis bends under its load, more so the further it is extended",
            .remedy =
                "a property of the axis: let the correction compensate for it; a sudden increase "
                "indicates a loose guide",
            .parameters = {{.name = "q#",
                            .unit = "1/(N m^2)",
                            .plausible = {0, 1e-3},
                            .only = model::JointType::kPrismatic}},
            .needs = {Signal::kWeight},
            .confused_with = {"joint_compliance", "link_bending", "gear_ratio", "link_geometry",
                              "bearing_tilt"},
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

const Effect& AxisBending() {
  static const EffectOf<AxisBendingFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
