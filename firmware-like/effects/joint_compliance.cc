#include "firmware-like/effects/joint_compliance.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct JointComplianceFormula {
  static EffectTraits Traits() {
    return {
        .id = "joint_compliance",
        .meaning = "the joint winds up under its gravity torque",
        .remedy =
            "a property of the gearbox: let the correction compensate for it; a sudden increase "
            "indicates wear",
        .parameters = {{.name = "q#",
                        .unit = "rad/(N m)",
                        .plausible = {-2e-5, 2e-4},
                        .prismatic_unit = "m/N",
                        .prismatic_plausible = {-1e-6, 1e-5}}},
        .needs = {Signal::kTorques},
        .confused_with = {"joint_hardening", "payload_mass", "payload_cog", "pedestal_compliance",
                          "link_geometry", "counterbalance", "backlash", "link_bending",
                          "bearing_tilt"},
        .per_joint = true,
        .adds_compliance = true,
        // Wind-up at the largest gravity torque: 2.2 to 3.2 mrad for arms with cycloidal or
        // strain wave gears [Dumas et al. 2011; Klimchik et al. 2013; makers' catalogues], 7 for
        // the softest class, arms with joint torque sensors, twice that the largest seen there.
        .largest_observed_rotation_rad = 7e-3,
        .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kCompliance}, term, values, influence);
  }
};

}  // namespace

const Effect& JointCompliance() {
  static const EffectOf<JointComplianceFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
