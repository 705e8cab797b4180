#include "firmware-like/deflection/loaded_arm.h"

#include <catch2/catch.hpp>

#include "firmware-like/geometry/rotation.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::loaded_arm_test {

using namespace plumbline::deflection;

TEST_CASE("the loaded tip of a rigid cell matches forward kinematics") {
  model::CellModel cell = test::HeavyArm();
  cell.tool.rigid = true;
  cell.tool.segments.clear();
  for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  const LoadedArm arm(cell);
  std::mt19937 random(10);
  const model::JointVector q = test::RandomPosture(cell, random);
  LoadedState state;
  REQUIRE(arm.AtCommanded(q, {50, Vec3(0, 0, 1)}, {}, state));
  CHECK((state.X_BT.p - arm.UnloadedTip(q).p).norm() < 1e-12);
}

TEST_CASE("the deflected posture is a fixed point, and its inverse is exact") {
  const model::CellModel cell = test::HeavyArm();
  const LoadedArm arm(cell);
  std::mt19937 random(11);
  for (int trial = 0; trial < 50; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const loads::Payload payload{80, *cell.payload_cog_F};
    LoadedState commanded, actual;
    REQUIRE(arm.AtCommanded(q, payload, {}, commanded));
    arm.AtActual(q + commanded.sag, payload, {}, actual);
    CHECK((actual.X_BT.p - commanded.X_BT.p).norm() < 1e-10);
    CHECK((q + actual.sag - (q + commanded.sag)).norm() < 1e-11);
  }
}

TEST_CASE("a horizontal arm sags by compliance times torque, computed by hand") {
  model::CellModel cell;
  model::Joint joint = test::MakeJoint(1.0, 0, 0, 0, -180, 180, 10, {-0.5, 0, 0}, 1e-5);
  cell.robot.joints = {joint};
  cell.robot.g_W = Vec3(0, -10, 0);  // the arm rotates about z; gravity acts along -y
  cell.tool.tcp_F = Vec3::Zero();
  const LoadedArm arm(cell);
  LoadedState state;
  REQUIRE(arm.AtCommanded(model::JointVector::Zero(1), {20, Vec3::Zero()}, {}, state));
  // tau = -(10 kg * 0.5 m + 20 kg * 1 m) * 10 m/s^2 cos(s) = -250 N m cos(s)
  const double sag = -250e-5;
  CHECK(state.tau[0] == Approx(-250 * std::cos(sag)).epsilon(1e-9));
  CHECK(state.X_BT.p.y() == Approx(std::sin(sag * std::cos(sag))).epsilon(1e-7));
}

TEST_CASE("the tool bends according to the closed form") {
  model::CellModel cell = test::HeavyArm();
  for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  const LoadedArm arm(cell);
  std::mt19937 random(12);
  const double L = 1.0, m = 60;
  const model::Section& section = cell.tool.segments[0].section;
  const model::Material& material = cell.tool.segments[0].material;
  const double EI = material.youngs_modulus_Pa * section.ix_m4;
  for (int trial = 0; trial < 20; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    LoadedState state;
    REQUIRE(arm.AtCommanded(q, {m, *cell.payload_cog_F}, {}, state));
    const Vec3 g_F = (cell.robot.X_WB.R * state.posture.X_BF().R).transpose() * cell.robot.g_W;
    const Vec3 F = m * g_F, M = (*cell.payload_cog_F - Vec3(0, 0, L)).cross(F);
    const Vec3 w = material.density_kg_m3 * section.area_m2 * g_F;
    CHECK(state.bend_F.x() == Approx(F.x() * L * L * L / (3 * EI) + M.y() * L * L / (2 * EI) +
                                     w.x() * L * L * L * L / (8 * EI)));
    CHECK(state.bend_F.y() == Approx(F.y() * L * L * L / (3 * EI) - M.x() * L * L / (2 * EI) +
                                     w.y() * L * L * L * L / (8 * EI)));
    CHECK(state.bend_F.z() == 0);
    // Slopes of a cantilever: d' = F L^2/2EI + M L/EI + w L^3/6EI.
    CHECK(state.slope_F.y() ==
          Approx(F.x() * L * L / (2 * EI) + M.y() * L / EI + w.x() * L * L * L / (6 * EI)));
    CHECK(state.slope_F.x() ==
          Approx(-F.y() * L * L / (2 * EI) + M.x() * L / EI - w.y() * L * L * L / (6 * EI)));
  }
}

TEST_CASE("an arm that leans with its pedestal equals the same arm on a rotated base") {
  model::CellModel cell = test::HeavyArm();
  const double compliance = 2e-7;
  model::WrittenEffect effect;
  effect.id = "pedestal_compliance";
  effect.parameters.push_back({"compliance", compliance, std::nullopt, "rad/(N m)", ""});
  model::CellModel leaning = cell;
  leaning.effects = {effect};
  std::mt19937 random(13);
  for (int trial = 0; trial < 20; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const loads::Payload payload{60, *cell.payload_cog_F};
    LoadedState got, turned;
    REQUIRE(LoadedArm(leaning).AtCommanded(q, payload, {}, got));
    Vec3 lean_W = Vec3::Zero();
    for (int pass = 0; pass < 20; ++pass) {
      model::CellModel still = cell;
      still.robot.X_WB.R = RotationFromVector(lean_W) * cell.robot.X_WB.R;
      const LoadedArm arm(still);
      REQUIRE(arm.AtCommanded(q, payload, {}, turned));
      model::JointVector tau;
      const Vec3 g_B = still.robot.X_WB.R.transpose() * cell.robot.g_W;
      const Vec3 moment_B = arm.loads().Torques<double>(turned.posture, g_B, payload, tau);
      lean_W = compliance * (still.robot.X_WB.R * moment_B);
    }
    CHECK(lean_W.norm() > 1e-4);
    CHECK((got.X_WT.p - turned.X_WT.p).norm() < 1e-9);
    CHECK((got.tau - turned.tau).norm() < 1e-6);
  }
}

TEST_CASE("undeclared link data matter only if a joint inboard of the link is compliant") {
  struct Case {
    const char* name;
    std::size_t yields;   ///< the only compliant joint; 6: none
    std::size_t unknown;  ///< the link without mass or centre
    bool counts;
  };
  const Case cases[] = {
      {"rigid arm", 6, 3, false},
      {"the link itself", 3, 3, true},
      {"a link beyond", 1, 3, true},
      {"a link before", 4, 3, false},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    model::CellModel cell = test::HeavyArm();
    for (std::size_t i = 0; i < 6; ++i) {
      if (i != c.yields) cell.robot.joints[i].compliance_rad_per_Nm.reset();
    }
    CHECK_FALSE(LoadedArm(cell).centres_guessed());
    cell.robot.joints[c.unknown].link_com_m.reset();
    CHECK(LoadedArm(cell).centres_guessed() == c.counts);
    CHECK_FALSE(LoadedArm(cell).torques_missing());
    cell.robot.joints[c.unknown].link_mass_kg.reset();
    CHECK(LoadedArm(cell).torques_missing() == c.counts);
  }
}

TEST_CASE("an effect that depends on joint torques needs outboard masses or measured torques") {
  struct Case {
    const char* name;
    model::WrittenEffect effect;
    std::size_t unknown;
    bool counts;
    bool by_weight = false;  // structural loads, not measured by torque sensors
  };
  const auto effect = [](const char* id, const char* parameter, const char* unit) {
    model::WrittenEffect written;
    written.id = id;
    written.parameters.emplace_back();
    written.parameters[0].name = parameter;
    written.parameters[0].value = 1e-7;
    written.parameters[0].unit = unit;
    return written;
  };
  const Case cases[] = {
      {"a link beyond", effect("joint_compliance", "q2", "rad/(N m)"), 3, true},
      {"a link before", effect("joint_compliance", "q5", "rad/(N m)"), 3, false},
      {"the whole arm", effect("pedestal_compliance", "compliance", "rad/(N m)"), 0, true, true},
      {"a bearing", effect("bearing_tilt", "q2", "rad/(N m)"), 3, true, true},
      {"a link's bending", effect("link_bending", "q5", "rad/(N m)"), 3, false, true},
      {"no torques", effect("joint_offset", "q2", "rad"), 3, false},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    model::CellModel cell = test::HeavyArm();
    for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
    cell.effects = {c.effect};
    CHECK_FALSE(LoadedArm(cell).torques_missing());
    cell.robot.joints[c.unknown].link_mass_kg.reset();
    CHECK(LoadedArm(cell).torques_missing() == c.counts);
    CHECK(LoadedArm(cell).torques_missing(true) == (c.counts && c.by_weight));
  }
}

namespace {

/// One joint and a link of 1 m along x of W with 10 kg at its end, 98.0665 N.
model::CellModel Boom() {
  model::CellModel cell;
  cell.robot.joints = {test::MakeJoint(1.0, 0, 0, 0, -180, 180, 0, {0, 0, 0}, 0)};
  cell.payload_cog_F = Vec3::Zero();
  return cell;
}

/// Displacement of the tip in W caused by one effect.
Vec3 MovedBy(model::CellModel cell, const std::string& id, const std::string& parameter,
             double value, double q = 0) {
  const loads::Payload payload{10, *cell.payload_cog_F};
  LoadedState without, with;
  const model::JointVector at = model::JointVector::Constant(1, q);
  REQUIRE(LoadedArm(cell).AtCommanded(at, payload, {}, without));
  model::WrittenEffect effect;
  effect.id = id;
  effect.parameters.resize(1);
  effect.parameters[0].name = parameter;
  effect.parameters[0].value = value;
  cell.effects = {effect};
  REQUIRE(LoadedArm(cell).AtCommanded(at, payload, {}, with));
  return with.X_WT.p - without.X_WT.p;
}

}  // namespace

TEST_CASE("bearings, links and slides deflect under outboard weight according to beam theory") {
  model::CellModel boom = Boom();
  // 98.0665 N m tilt the bearing at the root, a metre from the tip.
  CHECK(MovedBy(boom, "bearing_tilt", "q1", 1e-6).z() == Approx(-98.0665e-6));
  // F L^3 / (3 E I), L / (E I) = 1e-6.
  CHECK(MovedBy(boom, "link_bending", "q1", 1e-6).z() == Approx(-98.0665e-6 / 3));
  // A tip 0.3 m further out follows the slope F L^2 / (2 E I), too.
  boom.tool.tcp_F = Vec3(0.3, 0, 0);
  CHECK(MovedBy(boom, "link_bending", "q1", 1e-6).z() == Approx(-98.0665e-6 * (1 / 3.0 + 0.15)));
  // The weight hangs 0.5 m beside the link, the tip 0.2 m.
  boom.payload_cog_F = Vec3(0, 0.5, 0);
  boom.tool.tcp_F = Vec3(0, 0.2, 0);
  CHECK(MovedBy(boom, "link_bending", "q1_torsion", 1e-6).z() == Approx(-0.5 * 0.2 * 98.0665e-6));

  model::CellModel slide = Boom();
  slide.robot.joints[0].type = model::JointType::kPrismatic;
  slide.robot.joints[0].a_m = 0;
  slide.robot.X_WB.R << 0, 0, 1, 1, 0, 0, 0, 1, 0;  // along W's x
  CHECK(MovedBy(slide, "axis_bending", "q1", 1e-6, 2.0).z() == Approx(-98.0665e-6 * 8 / 3));
  CHECK(MovedBy(slide, "axis_bending", "q1", 1e-6, 0.0).norm() == 0);
  // Upright, the slide is compressed, in m/N.
  slide.robot.X_WB.R.setIdentity();
  CHECK(MovedBy(slide, "joint_compliance", "q1", 1e-8, 0.5).z() == Approx(-98.0665e-8));
}

TEST_CASE("a carriage with play tilts to the side of its load, less if both ends carry it") {
  model::CellModel upright = Boom();
  model::Joint& slide = upright.robot.joints[0];
  slide.type = model::JointType::kPrismatic;
  slide.a_m = 0;
  slide.alpha_rad = 0.7;  // after the frame of the guide: the tip, not the axes of the play
  upright.tool.tcp_F = Vec3(0, std::sin(0.7), std::cos(0.7));  // a metre above the carriage
  const auto at_lever = [&](double x, double y) {
    upright.payload_cog_F = Vec3(x, y * std::cos(0.7), -y * std::sin(0.7));
  };
  // Moment to width as 3 to 4 gives 0.6 of the play: a lever of 0.75 times 25 mm, for any weight.
  at_lever(0.01875, 0);
  CHECK((MovedBy(upright, "guide_play", "q1_y", 1e-4, 0.5) - Vec3(0.6e-4, 0, 0)).norm() < 1e-8);
  CHECK(MovedBy(upright, "guide_play", "q1_x", 1e-4, 0.5).norm() < 1e-12);
  at_lever(-0.01875, 0);
  CHECK((MovedBy(upright, "guide_play", "q1_y", 1e-4, 0.2) - Vec3(-0.6e-4, 0, 0)).norm() < 1e-8);
  at_lever(0, 0.01875);
  CHECK((MovedBy(upright, "guide_play", "q1_x", 1e-4, 0.5) - Vec3(0, 0.6e-4, 0)).norm() < 1e-8);
  // 12 to 5 gives 12/13.
  at_lever(0.06, 0);
  CHECK(MovedBy(upright, "guide_play", "q1_y", 1e-4).x() == Approx(1e-4 * 12 / 13).epsilon(1e-6));
  // The sign convention of the joint does not matter.
  slide.sign = -1;
  CHECK(MovedBy(upright, "guide_play", "q1_y", 1e-4).x() == Approx(1e-4 * 12 / 13).epsilon(1e-6));
}

TEST_CASE("a tilting base rotates about its origin while gravity keeps its direction") {
  model::CellModel boom = Boom();
  boom.robot.X_WB.p = Vec3(3, 0, 0);
  boom.robot.joints[0].compliance_rad_per_Nm = 1e-5;
  CHECK(MovedBy(boom, "tilt_event", "y", 0.01).norm() == 0);  // without an event time
  effects::Influence<double> influence;
  influence[effects::Influence<double>::kBaseTilt + 1] = 1e-3;
  LoadedStateOf<double> state;
  const LoadedArm arm(boom);
  REQUIRE(arm.AtCommanded(model::JointVector::Zero(1), {}, &influence, {}, state));
  CHECK((state.X_WT.p - Vec3(4, 0, -1e-3)).norm() < 1e-6);
  // About x of W, along the link: its weight now rotates the joint downhill.
  influence[effects::Influence<double>::kBaseTilt + 1] = 0;
  influence[effects::Influence<double>::kBaseTilt] = 1e-3;
  REQUIRE(arm.AtCommanded(model::JointVector::Zero(1), {10, Vec3::Zero()}, &influence, {}, state));
  CHECK(state.sag[0] == Approx(-1e-5 * 98.0665 * 1e-3).epsilon(1e-4));
}

TEST_CASE("coupled axes: an arm loaded at q is the uncoupled arm at C q") {
  model::CellModel cell = test::HeavyArm();
  const LoadedArm uncoupled(cell);
  cell.robot.couplings = {{2, 1, 1.0}, {4, 3, -0.3}};
  const LoadedArm coupled(cell);
  std::mt19937 random(11);
  for (int trial = 0; trial < 20; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    model::JointVector axes = q;
    axes[2] += q[1];
    axes[4] -= 0.3 * q[3];
    const loads::Payload payload{50, *cell.payload_cog_F};
    LoadedState expected, state, actual;
    REQUIRE(uncoupled.AtCommanded(axes, payload, {}, expected));
    REQUIRE(coupled.AtCommanded(q, payload, {}, state));
    CHECK((state.X_WT.p - expected.X_WT.p).norm() < 1e-12);
    CHECK((state.tau - expected.tau).norm() < 1e-8);
    // The deflections of the axes, as changes of the readings.
    CHECK(state.sag[2] == Approx(expected.sag[2] - expected.sag[1]).margin(1e-12));
    coupled.AtActual(q + state.sag, payload, {}, actual);
    CHECK((actual.X_WT.p - expected.X_WT.p).norm() < 1e-11);
  }
}

TEST_CASE("a parallelogram: the motors at the base carry the difference of the axes' torques") {
  model::CellModel cell;
  // Two links of 1 m in the plane x-y, each with its mass at the middle; gravity along -y.
  cell.robot.joints = {test::MakeJoint(1, 0, 0, 0, -180, 180, 10, {-0.5, 0, 0}, 1e-5),
                       test::MakeJoint(1, 0, 0, 0, -180, 180, 6, {-0.5, 0, 0}, 2e-5)};
  cell.robot.g_W = Vec3(0, -10, 0);
  cell.tool.tcp_F = Vec3::Zero();
  cell.robot.couplings = {{1, 0, -1.0, model::CouplingDrive::kReading}};
  const LoadedArm arm(cell);
  const model::JointVector q = Eigen::Vector2d(0.4, -0.3);  // the forearm's angle to the ground
  LoadedState state;
  REQUIRE(arm.AtCommanded(q, {20, Vec3::Zero()}, {}, state));
  const model::JointVector theta = q + state.sag;
  // Motor 1 carries its link, and everything beyond as if it hung at the elbow.
  CHECK(state.tau[0] == Approx(-10 * (10 * 0.5 + 6 + 20) * std::cos(theta[0])));
  CHECK(state.tau[1] == Approx(-10 * (6 * 0.5 + 20) * std::cos(theta[1])));
  CHECK(state.sag[0] == Approx(1e-5 * state.tau[0]));
  CHECK(state.sag[1] == Approx(2e-5 * state.tau[1]));
  // Its wind-up leaves the direction of the forearm.
  CHECK(std::atan2(state.X_WT.R(1, 0), state.X_WT.R(0, 0)) == Approx(theta[1]));
  // Driven at the axis, the forearm turns with the upper arm.
  cell.robot.couplings[0].drive = model::CouplingDrive::kAxis;
  REQUIRE(LoadedArm(cell).AtCommanded(q, {20, Vec3::Zero()}, {}, state));
  CHECK(state.sag[1] == Approx(2e-5 * state.tau[1] + state.sag[0]));
}

TEST_CASE("the torque of each drive is the work of gravity along its reading") {
  model::CellModel cell = test::HeavyArm();
  for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  cell.robot.couplings = {{2, 1, -1.0, model::CouplingDrive::kReading},
                          {4, 3, 0.3, model::CouplingDrive::kReading},
                          {5, 4, -0.5, model::CouplingDrive::kReading}};
  const LoadedArm arm(cell);
  const loads::Payload payload{40, *cell.payload_cog_F};
  const Vec3 g_B = cell.robot.X_WB.R.transpose() * cell.robot.g_W;
  const auto work = [&](const model::JointVector& q) {
    kinematics::Posture posture;
    arm.chain().Evaluate(q, posture);
    loads::OutboardMassesOf<double> outboard;
    model::JointVector tau;
    arm.loads().Torques<double>(posture, g_B, payload, tau, &outboard);
    return g_B.dot(outboard[0].kg_m);
  };
  std::mt19937 random(41);
  const model::JointVector q = test::RandomPosture(cell, random);
  LoadedState state;
  REQUIRE(arm.AtCommanded(q, payload, {}, state));
  for (int i = 0; i < 6; ++i) {
    constexpr double kStep = 1e-5;
    const model::JointVector step = kStep * model::JointVector::Unit(6, i);
    CHECK(state.tau[i] ==
          Approx((work(q + step) - work(q - step)) / (2 * kStep)).epsilon(1e-6).margin(1e-4));
  }
}

}  // namespace plumbline::loaded_arm_test
