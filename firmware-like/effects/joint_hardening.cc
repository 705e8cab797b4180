#include "firmware-like/effects/joint_hardening.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct JointHardeningFormula {
  static EffectTraits Traits() {
    return {.id = "joint_hardening",
            .meaning = "the joint's compliance decreases as its torque grows",
            .remedy = "a property of the gearbox: let the correction compensate for it",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)^3",
                            .plausible = {0, 1e-6},
                            .prismatic_unit = "m/N^3",
                            .prismatic_plausible = {0, 1e-6}}},
            .needs = {Signal::kTorques},
            .confused_with = {"joint_compliance", "backlash", "gear_periodic"},
            .per_joint = true,
            // The secant stiffness rises by at most 1.8 from zero to rated torque [K3/K1 of strain
            // wave gears, Harmonic Drive CSF catalogue]: less than half of the wind-up.
            .largest_observed_rotation_rad = 3.5e-3,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kHardening}, term, values, influence);
  }
};

}  // namespace

const Effect& JointHardening() {
  static const EffectOf<JointHardeningFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
