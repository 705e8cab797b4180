#include "firmware-like/effects/guide_play.h"

#include "firmware-like/effects/add_to_joints.h"

namespace plumbline::effects {
namespace {

struct GuidePlayFormula {
  static EffectTraits Traits() {
    return {.id = "guide_play",
            .meaning = "a sliding axis has play in its guide, and its load tips the carriage",
            .remedy =
                "adjust the preload of the carriage (gib, eccentric rollers), or replace it with "
                "one of a higher preload class",
            .parameters = {{.name = "q#_x",
                            .unit = "rad",
                            .plausible = {0, 2e-3},
                            .only = model::JointType::kPrismatic},
                           {.name = "q#_y",
                            .unit = "rad",
                            .plausible = {0, 2e-3},
                            .only = model::JointType::kPrismatic}},
            .needs = {Signal::kWeight},
            .confused_with = {"axis_bending", "bearing_tilt", "backlash", "link_geometry",
                              "joint_offset", "base_frame", "link_bending", "pedestal_compliance"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    AddToJoints<T>({Influence<T>::kGuideTiltX, Influence<T>::kGuideTiltY}, term, values, influence);
  }
};

}  // namespace

const Effect& GuidePlay() {
  static const EffectOf<GuidePlayFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
