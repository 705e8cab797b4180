#include "firmware-like/effects/catalogue.h"

#include <catch2/catch.hpp>
#include <set>

#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::catalogue_test {

using namespace plumbline::effects;

namespace {

/// As files have them: id, then parameters with units.
const std::vector<std::string> kTable = {
    "base_frame: x mm, y mm, z mm, roll deg, pitch deg, yaw deg",
    "tool_frame: x mm, y mm, z mm",
    "joint_offset: q# rad",
    "gear_ratio: q# 1",
    "axis_coupling: q#_of_q# 1",
    "link_geometry: a# mm, d# mm, alpha# deg, beta# deg",
    "joint_compliance: q# rad/(N m)",
    "compliance_asymmetry: q# rad/(N m)",
    "joint_hardening: q# rad/(N m)^3",
    "counterbalance: q#_amplitude N m, q#_phase rad",
    "tool_stiffness: ratio 1",
    "tool_shear: kappa 1",
    "tool_root_compliance: compliance rad/(N m)",
    "payload_mass: scale 1, constant kg",
    "payload_cog: x mm, y mm, z mm",
    "gravity_direction: x rad, y rad",
    "pedestal_compliance: compliance rad/(N m)",
    "bearing_tilt: q# rad/(N m)",
    "link_bending: q# rad/(N m), q#_torsion rad/(N m)",
    "axis_bending: q# 1/(N m^2)",
    "guide_play: q#_x rad, q#_y rad",
    "gravity_sag: q# rad/(N m), q#_link#_x rad, q#_link#_y rad",
    "backlash: q# rad, by (load,move)",
    "approach_lag: q# 1",
    "following_error: q# rad",
    "arrival_friction: q# rad/(N m)",
    ("gear_periodic: q#_amplitude rad, q#_cycles 1/turn, q#_phase rad, q#_#_amplitude rad, "
     "q#_#_cycles 1/turn, q#_#_phase rad"),
    "thermal_growth: alpha 1/K",
    "thermal_drift: x mm, y mm, z mm, time_constant s",
    "latency: time s",
    "dynamic_inertia: q# s^2",
    "measurement_scale: scale 1",
    "step_event: time s, row 1, x mm, y mm, z mm, frame (base,tool)",
    "tilt_event: time s, row 1, x deg, y deg",
    "offset_event: time s, row 1, q# rad",
    "base_tilt: gain 1",
    "range_zero: zero mm",
    "range_anchor: x mm, y mm, z mm",
    "camera_tag_size: scale 1",
    "camera_zoom: time s, row 1, scale 1",
    "camera_lens: k1 1",
    ("camera_frame: x mm, y mm, z mm, roll deg, pitch deg, yaw deg, scale 1, camera "
     "(side,rear,front,top,side+rear,side+front,side+top,rear+front,rear+top,front+top)"),
};

std::string LineOf(const EffectTraits& traits) {
  std::string line(traits.id);
  for (const ParameterSpec& spec : traits.parameters) {
    line += &spec == traits.parameters.data() ? ": " : ", ";
    line += std::string(spec.name) + " ";
    line += spec.role == ParameterRole::kWord ? "(" + std::string(spec.words) + ")"
                                              : std::string(spec.unit);
  }
  return line;
}

TEST_CASE("Ids, parameters and units of the effects are as files have them, in order") {
  std::vector<std::string> lines;
  for (const Effect* effect : Catalogue()) lines.push_back(LineOf(effect->traits()));
  CHECK(lines == kTable);
}

TEST_CASE("Each effect is found by its id only") {
  for (const Effect* effect : Catalogue()) CHECK(FindEffect(effect->traits().id) == effect);
  CHECK(FindEffect("empirical") == &Empirical());
  CHECK(FindEffect("creep") == nullptr);
  CHECK(FindEffect("joint") == nullptr);
  CHECK(FindEffect("") == nullptr);
}

TEST_CASE(
    "Each effect has texts for report and document, and the effects it is confused with exist") {
  for (const Effect* effect : Catalogue()) {
    const EffectTraits& traits = effect->traits();
    CAPTURE(traits.id);
    CHECK_FALSE(traits.meaning.empty());
    CHECK_FALSE(traits.remedy.empty());
    CHECK_FALSE(traits.formula.empty());
    CHECK_FALSE(traits.shown_by.empty());
    CHECK_FALSE(traits.confused_with.empty());
    std::set<std::string_view> seen;
    for (const std::string_view other : traits.confused_with) {
      CAPTURE(other);
      CHECK(FindEffect(other) != nullptr);
      CHECK(other != traits.id);
      CHECK(seen.insert(other).second);
    }
  }
}

TEST_CASE("Plausible ranges are finite, those of sizes include zero, and words have choices") {
  for (const Effect* effect : Catalogue()) {
    for (const ParameterSpec& spec : effect->traits().parameters) {
      CAPTURE(effect->traits().id, spec.name);
      if (spec.role == ParameterRole::kWord) {
        CHECK(Choices(spec.words).size() >= 2);
        continue;
      }
      CHECK(spec.plausible.low < spec.plausible.high);
      CHECK(std::abs(spec.plausible.low) <= 1e7);
      CHECK(std::abs(spec.plausible.high) <= 1e7);
      if (spec.role == ParameterRole::kSize && !spec.inverse) CHECK(spec.plausible.Contains(0));
      if (spec.inverse) CHECK(spec.plausible.low > 0);
      CHECK(spec.to_SI > 0);
    }
  }
}

TEST_CASE("The signals required by backlash depend on its word") {
  const EffectTraits& traits = FindEffect("backlash")->traits();
  CHECK(traits.Needs(Signal::kTorques, "load"));
  CHECK_FALSE(traits.Needs(Signal::kTorques, "move"));
  CHECK(traits.Needs(Signal::kOrder, "move"));
  CHECK(FindEffect("latency")->traits().Needs(Signal::kVelocity));
}

TEST_CASE("The unit of a compliance or an offset depends on the joint type") {
  const ParameterSpec& spec = FindEffect("joint_compliance")->traits().parameters[0];
  const std::uint32_t first_slides = 1;
  CHECK(UnitOf(spec, first_slides, 0) == "m/N");
  CHECK(UnitOf(spec, first_slides, 1) == "rad/(N m)");
  // A spindle of 100 N/um is plausible; as rad/(N m) of a revolute joint, 100 N/mm would be too.
  CHECK(PlausibleOf(spec, "", first_slides, 0).Contains(1e-8));
  CHECK_FALSE(PlausibleOf(spec, "", first_slides, 0).Contains(1e-4));
  CHECK(PlausibleOf(spec, "", first_slides, 1).Contains(1e-4));
  const ParameterSpec& offset = FindEffect("joint_offset")->traits().parameters[0];
  CHECK(UnitOf(offset, first_slides, 0) == "m");
  CHECK(UnitOf(offset, first_slides, 1) == "rad");
}

TEST_CASE("A backlash by load cannot be negative, as the joint would yield against its load") {
  const ParameterSpec& gap = FindEffect("backlash")->traits().parameters[0];
  CHECK_FALSE(PlausibleOf(gap, "load", 0, 1).Contains(-1e-4));
  CHECK(PlausibleOf(gap, "load", 0, 1).Contains(1e-4));
  // By move, the sign depends on the side from which the controller compensates for it.
  CHECK(PlausibleOf(gap, "move", 0, 1).Contains(-1e-4));
}

TEST_CASE("Parameter names are parsed, and formatted back to the same name") {
  struct Case {
    std::string id, name;
    TermParameter parameter;
  };
  for (const Case& good :
       {Case{"link_geometry", "alpha6", {2, 5, 1}}, Case{"link_geometry", "a12", {0, 11, 1}},
        Case{"gear_periodic", "q3_phase", {2, 2, 1}},
        Case{"gear_periodic", "q3_2_phase", {5, 2, 2}},
        Case{"gear_periodic", "q1_10_cycles", {4, 0, 10}}, Case{"backlash", "by", {1, -1, 1}},
        Case{"base_frame", "yaw", {5, -1, 1}}, Case{"axis_coupling", "q5_of_q4", {0, 4, 1, 3}},
        Case{"axis_coupling", "q12_of_q1", {0, 11, 1, 0}}, Case{"gravity_sag", "q2", {0, 1, 1}},
        Case{"gravity_sag", "q2_link2_x", {1, 1, 1, 1}},
        Case{"gravity_sag", "q2_link12_y", {2, 1, 1, 11}},
        Case{"link_bending", "q3_torsion", {1, 2, 1}}, Case{"link_geometry", "beta2", {3, 1, 1}},
        Case{"empirical", "q2", {6, 1, 1}}, Case{"empirical", "tip_z", {5, -1, 1}}}) {
    CAPTURE(good.id, good.name);
    const EffectTraits& traits = FindEffect(good.id)->traits();
    const auto parameter = ParameterFromName(traits, good.name, 12);
    REQUIRE(parameter);
    CHECK(*parameter == good.parameter);
    CHECK(NameFromParameter(traits, *parameter) == good.name);
  }
  for (const Case& bad :
       {Case{"link_geometry", "alpha13", {}}, Case{"link_geometry", "alpha0", {}},
        Case{"link_geometry", "alpha", {}}, Case{"link_geometry", "a02", {}},
        Case{"link_geometry", "a99999999999999999999", {}}, Case{"joint_offset", "q-1", {}},
        Case{"gear_periodic", "q3_1_phase", {}}, Case{"gear_periodic", "q3__phase", {}},
        Case{"axis_coupling", "q4_of_q4", {}}, Case{"axis_coupling", "q3_of_q5", {}},
        Case{"axis_coupling", "q3_of_q0", {}}, Case{"axis_coupling", "q13_of_q2", {}},
        Case{"gravity_sag", "q3_link2_x", {}}, Case{"gravity_sag", "q3_link13_x", {}},
        Case{"gravity_sag", "q3_link3_z", {}}, Case{"axis_coupling", "q3_of_", {}},
        Case{"gear_periodic", "q3_phases", {}}, Case{"joint_offset", "", {}}}) {
    CAPTURE(bad.id, bad.name);
    CHECK_FALSE(ParameterFromName(FindEffect(bad.id)->traits(), bad.name, 12));
  }
  CHECK(JointFromScope("q12", 12) == 11);
  CHECK_FALSE(JointFromScope("q13", 12));
  CHECK_FALSE(JointFromScope("q1x", 12));
  CHECK_FALSE(JointFromScope("", 12));
}

}  // namespace
}  // namespace plumbline::catalogue_test
