#include "firmware-like/effects/link_geometry.h"

#include <array>

namespace plumbline::effects {
namespace {

struct LinkGeometryFormula {
  static EffectTraits Traits() {
    return {.id = "link_geometry",
            .meaning = "the arm's links differ from the declared DH table",
            .remedy =
                "a property of this arm: let the correction compensate for it; a sudden change "
                "indicates a collision",
            .parameters = {{"a#", "mm", 1e-3, {-5, 5}},
                           {"d#", "mm", 1e-3, {-5, 5}},
                           {"alpha#", "deg", kRadPerDeg, {-0.5, 0.5}},
                           {.name = "beta#",
                            .unit = "deg",
                            .to_SI = kRadPerDeg,
                            .plausible = {-0.5, 0.5},
                            .parallel_axes_only = true}},
            .needs = {},
            .confused_with = {"joint_offset", "thermal_growth", "measurement_scale", "base_frame",
                              "tool_frame", "joint_compliance"},
            .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    constexpr std::array kEntries = {Influence<T>::kLengthA, Influence<T>::kOffsetD,
                                     Influence<T>::kTwistAlpha, Influence<T>::kTwistBeta};
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      const auto entry = kEntries[static_cast<std::size_t>(parameter.spec)];
      influence.Joint(entry, parameter.joint) += values[k];
    }
  }
};

}  // namespace

const Effect& LinkGeometry() {
  static const EffectOf<LinkGeometryFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
