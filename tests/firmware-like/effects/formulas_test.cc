// Contribution of each effect under given conditions, against hand-written formulas in file units.
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/written.h"
#include "tests/firmware-like/effects/small_cell.h"

namespace plumbline::formulas_test {

using namespace plumbline::effects;

namespace {

using I = Influence<double>;

int At(I::JointEntry entry, int joint) {
  return entry * model::kMaxJoints + joint - 1;
}

struct Number {
  std::string name;
  double value;
};

struct Expected {
  int entry;
  double value;
};

struct Case {
  std::string id;
  std::vector<Number> numbers;
  std::pair<std::string, std::string> word;
  std::vector<Expected> expected;
};

model::WrittenEffect Written(const Case& c) {
  model::WrittenEffect written;
  written.id = c.id;
  for (const Number& number : c.numbers) {
    model::EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = number.name;
    parameter.value = number.value;
  }
  if (!c.word.first.empty()) {
    model::EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = c.word.first;
    parameter.word = c.word.second;
  }
  return written;
}

I Sum(const Case& c, const Conditions& moment) {
  const std::vector<ActiveEffect> effects = {ActiveFromWritten(Written(c), SmallCell())};
  I influence;
  AddEffects(effects, moment, influence);
  return influence;
}

const std::vector<Case>& Cases() {
  constexpr double kRad = 0.017453292519943295;  // of one degree
  static const std::vector<Case> cases = {
      {"base_frame",
       {{"x", 1}, {"z", -2}, {"roll", 0.1}, {"yaw", -0.2}},
       {},
       {{I::kBase, 1e-3},
        {I::kBase + 2, -2e-3},
        {I::kBaseRollPitchYaw, 0.1 * kRad},
        {I::kBaseRollPitchYaw + 2, -0.2 * kRad}}},
      {"tool_frame", {{"y", 3}, {"z", 4}}, {}, {{I::kTip + 1, 3e-3}, {I::kTip + 2, 4e-3}}},
      {"joint_offset",
       {{"q1", 1e-3}, {"q6", -2e-3}},
       {},
       {{At(I::kTurn, 1), 1e-3}, {At(I::kTurn, 6), -2e-3}}},
      {"gear_ratio", {{"q3", 1e-3}}, {}, {{At(I::kTurn, 3), 1e-3 * -0.2}}},
      {"axis_coupling",
       {{"q3_of_q2", 1e-3}, {"q6_of_q1", 2e-3}},
       {},
       {{At(I::kTurn, 3), 1e-3 * -0.6}, {At(I::kTurn, 6), 2e-3 * -1.0}}},
      {"link_geometry",
       {{"a2", 0.5}, {"d3", -0.4}, {"alpha4", 0.1}, {"beta2", 0.2}},
       {},
       {{At(I::kLengthA, 2), 0.5e-3},
        {At(I::kTwistBeta, 2), 0.2 * kRad},
        {At(I::kOffsetD, 3), -0.4e-3},
        {At(I::kTwistAlpha, 4), 0.1 * kRad}}},
      {"joint_compliance",
       {{"q2", 5.1e-7}, {"q3", 6e-7}},
       {},
       {{At(I::kCompliance, 2), 5.1e-7}, {At(I::kCompliance, 3), 6e-7}}},
      {"compliance_asymmetry", {{"q2", -3e-7}}, {}, {{At(I::kLoadShare, 2), -3e-7}}},
      {"joint_hardening", {{"q2", 4e-14}}, {}, {{At(I::kHardening, 2), 4e-14}}},
      {"counterbalance",
       {{"q2_amplitude", 800}, {"q2_phase", 0.5}},
       {},
       {{At(I::kTorque, 2), 800 * std::sin(-0.6 + 0.5)}}},
      {"tool_stiffness", {{"ratio", -0.2}}, {}, {{I::kBendRatio, 0.25}}},
      {"tool_shear", {{"kappa", 0.8}}, {}, {{I::kShear, 1.25}}},
      {"tool_root_compliance", {{"compliance", 2e-6}}, {}, {{I::kRootCompliance, 2e-6}}},
      {"payload_mass",
       {{"scale", 0.1}, {"constant", -1.5}},
       {},
       {{I::kPayloadMass, 0.1 * 40 - 1.5}}},
      {"payload_cog",
       {{"x", 10}, {"z", -20}},
       {},
       {{I::kPayloadCog, 0.010}, {I::kPayloadCog + 2, -0.020}}},
      {"gravity_direction",
       {{"x", 0.01}, {"y", -0.02}},
       {},
       {{I::kGravityTurnX, 0.01}, {I::kGravityTurnY, -0.02}}},
      {"pedestal_compliance", {{"compliance", 3e-8}}, {}, {{I::kPedestalCompliance, 3e-8}}},
      {"bearing_tilt",
       {{"q2", 1e-8}, {"q4", 2e-8}},
       {},
       {{At(I::kBearing, 2), 1e-8}, {At(I::kBearing, 4), 2e-8}}},
      {"link_bending",
       {{"q2", 1e-8}, {"q2_torsion", 3e-8}},
       {},
       {{At(I::kLinkBending, 2), 1e-8}, {At(I::kLinkTorsion, 2), 3e-8}}},
      {"axis_bending", {{"q1", 1e-7}}, {}, {{At(I::kBearing, 1), 1e-7}}},
      {"guide_play",
       {{"q1_x", 2e-4}, {"q1_y", 3e-4}},
       {},
       {{At(I::kGuideTiltX, 1), 2e-4}, {At(I::kGuideTiltY, 1), 3e-4}}},
      // All axes of the small cell are vertical, like gravity: links cause no sag, whatever they
      // weigh.
      {"gravity_sag",
       {{"q2", 2e-6}, {"q2_link2_x", 1e-3}, {"q2_link3_y", -2e-3}},
       {},
       {{At(I::kCompliance, 2), 2e-6}}},
      {"tilt_event",
       {{"time", 600}, {"x", 0.02}, {"y", -0.03}},
       {},
       {{I::kBaseTilt, 0.02 * kRad}, {I::kBaseTilt + 1, -0.03 * kRad}}},
      {"tilt_event", {{"row", 8}, {"x", 0.02}}, {}, {}},
      {"offset_event",
       {{"time", 600}, {"q2", 1e-3}, {"q4", -2e-3}},
       {},
       {{At(I::kTurn, 2), 1e-3}, {At(I::kTurn, 4), -2e-3}}},
      {"offset_event", {{"row", 8}, {"q2", 1e-3}}, {}, {}},
      {"base_tilt",
       {{"gain", 0.5}},
       {},
       {{I::kBaseTilt, 0.5 * 0.02 * kRad}, {I::kBaseTilt + 1, 0.5 * -0.01 * kRad}}},
      {"range_zero", {{"zero", 2}}, {}, {{I::kRangeZero, 2e-3}}},
      {"range_anchor",
       {{"x", 1}, {"z", -3}},
       {},
       {{I::kRangeAnchor, 1e-3}, {I::kRangeAnchor + 2, -3e-3}}},
      {"backlash", {{"q2", 1e-4}}, {"by", "load"}, {{At(I::kLoadGap, 2), 1e-4}}},
      {"backlash", {{"q2", 1e-4}}, {}, {{At(I::kLoadGap, 2), 1e-4}}},
      {"backlash",
       {{"q1", 1e-4}, {"q2", 2e-4}, {"q5", 3e-4}},
       {"by", "move"},
       {{At(I::kTurn, 1), 1e-4}, {At(I::kTurn, 2), -2e-4}}},
      {"approach_lag", {{"q3", 0.01}}, {}, {{At(I::kTurn, 3), -0.01 * 0.5}}},
      // In the last move the leading joint moved by 0.8, q3 by 0.5 and q2 by 0.4.
      {"following_error",
       {{"q3", 1e-3}, {"q6", 2e-3}},
       {},
       {{At(I::kTurn, 3), -1e-3 * 0.625}, {At(I::kTurn, 6), -2e-3}}},
      {"arrival_friction", {{"q2", 1e-6}}, {}, {{At(I::kLoadShare, 2), -1e-6 * 0.5}}},
      {"gear_periodic",
       {{"q3_amplitude", 1e-4},
        {"q3_cycles", 50},
        {"q3_phase", 0.3},
        {"q3_2_amplitude", 2e-4},
        {"q3_2_cycles", 101.5},
        {"q3_2_phase", -1},
        {"q4_amplitude", 3e-4}},
       {},
       {{At(I::kTurn, 3), 1e-4 * std::sin(50 * -0.2 + 0.3) + 2e-4 * std::sin(101.5 * -0.2 - 1.0)},
        {At(I::kTurn, 4), 3e-4 * std::sin(0.2)}}},
      {"thermal_growth",
       {{"alpha", 2e-5}},
       {},
       {{At(I::kLengthA, 1), 1e-4 * 0.1},
        {At(I::kLengthA, 2), 1e-4 * 0.2},
        {At(I::kLengthA, 3), 1e-4 * 0.3},
        {At(I::kLengthA, 4), 1e-4 * 0.4},
        {At(I::kLengthA, 5), 1e-4 * 0.5},
        {At(I::kLengthA, 6), 1e-4 * 0.6},
        {At(I::kOffsetD, 1), 1e-4 * 0.10},
        {At(I::kOffsetD, 2), 1e-4 * 0.15},
        {At(I::kOffsetD, 3), 1e-4 * 0.20},
        {At(I::kOffsetD, 4), 1e-4 * 0.25},
        {At(I::kOffsetD, 5), 1e-4 * 0.30},
        {At(I::kOffsetD, 6), 1e-4 * 0.35}}},
      {"thermal_drift",
       {{"x", 0.4}, {"z", -0.1}, {"time_constant", 1200}},
       {},
       {{I::kBase, 0.4e-3 * (1 - std::exp(-0.5))}, {I::kBase + 2, -0.1e-3 * (1 - std::exp(-0.5))}}},
      {"latency",
       {{"time", 0.01}},
       {},
       {{At(I::kTurn, 1), -0.001},
        {At(I::kTurn, 2), -0.003},
        {At(I::kTurn, 3), -0.005},
        {At(I::kTurn, 4), -0.007},
        {At(I::kTurn, 5), -0.009},
        {At(I::kTurn, 6), -0.011}}},
      {"dynamic_inertia", {{"q1", 2e-4}}, {}, {{At(I::kTurn, 1), 2e-4 * 2}}},
      {"measurement_scale", {{"scale", 1e-4}}, {}, {{I::kScale, 1e-4}}},
      {"step_event", {{"time", 600}, {"x", 0.3}}, {"frame", "base"}, {{I::kBase, 0.3e-3}}},
      {"step_event", {{"time", 600.1}, {"x", 0.3}}, {"frame", "base"}, {}},
      {"step_event",
       {{"row", 7}, {"y", 0.3}, {"z", 0.2}},
       {"frame", "tool"},
       {{I::kTip + 1, 0.3e-3}, {I::kTip + 2, 0.2e-3}}},
      {"step_event", {{"row", 8}, {"z", 0.3}}, {"frame", "tool"}, {}},
      {"step_event", {{"x", 0.3}}, {}, {}},
      {"camera_tag_size", {{"scale", 0.02}}, {}, {{I::kCameraScale, 0.02}}},
      {"camera_zoom", {{"scale", -0.03}}, {}, {{I::kCameraDepth, -0.03}}},
      {"camera_zoom", {{"time", 600}, {"scale", 0.01}}, {}, {{I::kCameraDepth, 0.01}}},
      {"camera_zoom", {{"time", 601}, {"scale", 0.01}}, {}, {}},
      {"camera_zoom", {{"row", 7}, {"scale", 0.01}}, {}, {{I::kCameraDepth, 0.01}}},
      {"camera_zoom", {{"row", 8}, {"scale", 0.01}}, {}, {}},
      {"camera_lens", {{"k1", -0.04}}, {}, {{I::kCameraRadial, -0.04}}},
      {"camera_frame",
       {{"y", 2}, {"roll", 0.1}, {"pitch", 0.2}, {"yaw", 0.3}, {"scale", 0.003}},
       {"camera", "rear"},
       {{I::kBase + 1, 2e-3},
        {I::kBaseTilt, 0.1 * kRad},
        {I::kGravityTurnX, 0.1 * kRad},
        {I::kBaseTilt + 1, 0.2 * kRad},
        {I::kGravityTurnY, 0.2 * kRad},
        {I::kBaseRollPitchYaw + 2, 0.3 * kRad},
        {I::kScale, 0.003}}},
      {"camera_frame", {{"x", 1}}, {"camera", "side"}, {}},
  };
  return cases;
}

TEST_CASE("Each effect adds the value of its formula to its own entries only") {
  const Conditions moment = KnownMoment();
  std::set<std::string> seen;
  for (const Case& c : Cases()) {
    CAPTURE(c.id);
    seen.insert(c.id);
    I rest = Sum(c, moment);
    for (const Expected& expected : c.expected) {
      CAPTURE(expected.entry);
      CHECK(rest[expected.entry] == Approx(expected.value).epsilon(1e-13));
      rest[expected.entry] = 0;
    }
    for (int entry = 0; entry < I::kSize; ++entry) {
      CAPTURE(entry);
      CHECK(rest[entry] == 0.0);
    }
  }
  for (const Effect* effect : Catalogue()) CHECK(seen.count(std::string(effect->traits().id)) == 1);
}

TEST_CASE("An effect adds nothing if a required signal is absent") {
  struct Absent {
    std::string id;
    std::string word;
    void (*forget)(Conditions&);
  };
  const std::vector<Absent> absences = {
      {"thermal_growth", "", [](Conditions& moment) { moment.temp_C.reset(); }},
      {"thermal_growth", "", [](Conditions& moment) { moment.reference_temperature_C.reset(); }},
      {"thermal_drift", "", [](Conditions& moment) { moment.t_s.reset(); }},
      {"latency", "", [](Conditions& moment) { moment.qd.resize(0); }},
      {"dynamic_inertia", "", [](Conditions& moment) { moment.qdd.resize(0); }},
      {"approach_lag", "", [](Conditions& moment) { moment.last_move.resize(0); }},
      {"following_error", "", [](Conditions& moment) { moment.last_move.resize(0); }},
      {"following_error", "", [](Conditions& moment) { moment.last_move.setZero(); }},
      {"arrival_friction", "", [](Conditions& moment) { moment.last_move.resize(0); }},
      {"backlash", "move", [](Conditions& moment) { moment.approach.resize(0); }},
      {"step_event", "base", [](Conditions& moment) { moment.t_s.reset(); }},
      {"step_event", "tool", [](Conditions& moment) { moment.row.reset(); }},
      {"camera_tag_size", "", [](Conditions& moment) { moment.camera = false; }},
      {"camera_zoom", "", [](Conditions& moment) { moment.camera = false; }},
      {"camera_lens", "", [](Conditions& moment) { moment.camera = false; }},
      {"camera_frame", "rear", [](Conditions& moment) { moment.camera_name.clear(); }},
      {"tilt_event", "", [](Conditions& moment) { moment.t_s.reset(); }},
      {"offset_event", "", [](Conditions& moment) { moment.t_s.reset(); }},
      {"base_tilt", "", [](Conditions& moment) { moment.further.clear(); }},
      {"gravity_sag", "", [](Conditions& moment) { moment.robot.reset(); }},
  };
  for (const Absent& absent : absences) {
    CAPTURE(absent.id);
    int tried = 0;
    for (const Case& c : Cases()) {
      if (c.id != absent.id || c.word.second != absent.word || c.expected.empty()) continue;
      ++tried;
      Conditions moment = KnownMoment();
      absent.forget(moment);
      const I influence = Sum(c, moment);
      for (int entry = 0; entry < I::kSize; ++entry) CHECK(influence[entry] == 0.0);
    }
    CHECK(tried > 0);
  }
}

TEST_CASE("The torque of unknown weight depends on the link directions perpendicular to gravity") {
  // Two joints in a vertical plane, rotating about x of W.
  for (const model::DhConvention convention :
       {model::DhConvention::kDistal, model::DhConvention::kProximal}) {
    model::CellModel cell;
    cell.robot.convention = convention;
    cell.robot.joints.resize(2);
    cell.robot.X_WB.R << 0, 0, 1, 1, 0, 0, 0, 1, 0;  // B's z is W's x, B's x is W's y
    Conditions moment = DeclaredConditions(cell);
    moment.q = model::JointVector(Eigen::Vector2d(0.3, 0.4));
    const auto turns = [&](const std::string& name, int joint) {
      const model::WrittenEffect written = Written({"gravity_sag", {{name, 1e-3}}, {}, {}});
      I influence;
      AddEffects(std::vector<ActiveEffect>{ActiveFromWritten(written, cell)}, moment, influence);
      return influence.Joint(I::kTurn, joint - 1);
    };
    // A weight along x of link 1, 0.3 rad above the horizontal, acts with cos(0.3).
    CHECK(turns("q1_link1_x", 1) == Approx(-1e-3 * std::cos(0.3)));
    CHECK(turns("q1_link1_y", 1) == Approx(1e-3 * std::sin(0.3)));
    CHECK(turns("q1_link2_x", 1) == Approx(-1e-3 * std::cos(0.7)));
    CHECK(turns("q2_link2_y", 2) == Approx(1e-3 * std::sin(0.7)));
    CHECK(turns("q2_link2_y", 1) == 0);
  }
}

TEST_CASE("Effects add up") {
  const std::vector<ActiveEffect> effects = {
      ActiveFromWritten(Written({"joint_offset", {{"q3", 1e-3}}, {}, {}}), SmallCell()),
      ActiveFromWritten(Written({"gear_ratio", {{"q3", 1e-3}}, {}, {}}), SmallCell())};
  I influence;
  AddEffects(effects, KnownMoment(), influence);
  CHECK(influence.Joint(I::kTurn, 2) == Approx(1e-3 - 0.2e-3).epsilon(1e-14));
}

}  // namespace
}  // namespace plumbline::formulas_test
