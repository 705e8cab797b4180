// Each effect changes the true pose according to its formula.
#include "tests/virtual_cell/effects.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/virtual_cell/world.h"

namespace virtual_cell::effects_test {
namespace {

CellDescription DemoCell() {
  return ReadCellFile("tests/virtual_cell/demo/cockpit-cell.toml");
}

Joints Posture() {
  Joints q(6);
  q << 0.3, -1.6, 1.9, 0.2, 0.4, -0.3;
  return q;
}

Truth With(const std::vector<std::string>& texts, WorldInputs now = {}) {
  if (now.q.size() == 0) now.q = Posture();
  if (now.payload_kg == 0) now.payload_kg = 60;
  Truth truth = World(DemoCell(), Effects(EffectsFromTexts(texts))).Settle(now);
  REQUIRE(truth.converged);
  return truth;
}

double Difference_mm(const Truth& a, const Truth& b) {
  return 1e3 * (a.X_WT.translation() - b.X_WT.translation()).norm();
}

TEST_CASE("joint effects change the deflection according to their formulas") {
  const Truth plain = With({});
  const double tau2 = plain.torque[1], q3 = Posture()[2];
  struct Row {
    const char* text;
    int joint;
    double expected;
  };
  const Row rows[] = {
      {"joint_compliance:q2=1e-7", 1, 1e-7 * tau2},
      {"joint_hardening:q2=1e-15", 1, -1e-15 * tau2 * tau2 * tau2},
      {"joint_offset:q3=1e-3", 2, 1e-3},
      {"gear_ratio:q3=1e-4", 2, 1e-4 * q3},
      {"gear_periodic:q3_amplitude=2e-4,q3_cycles=3,q3_phase=0.5", 2,
       2e-4 * std::sin(3 * q3 + 0.5)},
      {"backlash:q2=1e-4", 1, std::copysign(1e-4, tau2)},
      {"counterbalance:q2_amplitude=-800,q2_phase=1.5", 1,
       4e-7 * -800 * std::sin(Posture()[1] + 1.5)},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const Truth truth = With({row.text});
    CHECK(truth.deflection[row.joint] - plain.deflection[row.joint] ==
          Approx(row.expected).epsilon(5e-3));
    CHECK(Difference_mm(truth, plain) > 0.01);
  }
}

TEST_CASE("backlash and approach lag depend on the last move") {
  Joints up = Joints::Zero(6);
  up[1] = 0.2;
  const Joints down = -up;
  SECTION("backlash changes side") {
    const Truth a = With({"backlash:q2=1e-4,by=move"}, {.q = Posture(), .last_move = up});
    const Truth b = With({"backlash:q2=1e-4,by=move"}, {.q = Posture(), .last_move = down});
    CHECK(a.deflection[1] - b.deflection[1] == Approx(2e-4).epsilon(5e-3));
  }
  SECTION("approach_lag falls short of the move") {
    const Truth a = With({"approach_lag:q2=1e-3"}, {.q = Posture(), .last_move = up});
    CHECK(a.deflection[1] - With({}).deflection[1] == Approx(-2e-4).epsilon(5e-3));
  }
}

TEST_CASE("effects on the tool") {
  const Truth plain = With({});
  const auto bend = [](const Truth& truth) {
    return (truth.X_WF.inverse() * truth.X_WT.translation()).head<2>().norm();
  };
  SECTION("stiffness") {
    CHECK(bend(With({"tool_stiffness:ratio=0.25"})) == Approx(bend(plain) / 1.25).epsilon(2e-3));
  }
  SECTION("creep grows with the logarithm of time") {
    const Truth later =
        With({"creep:amplitude=0.1,time_constant=100"}, {.q = Posture(), .time_s = 900});
    CHECK(bend(later) == Approx(bend(plain) * (1 + 0.1 * std::log(10.0))).epsilon(2e-3));
  }
  SECTION("shear adds F L / kGA") {
    const CellDescription cell = DemoCell();
    const Vec3 g_F = plain.X_WF.linear().transpose() * cell.gravity_W;
    const double expected = 60 * g_F.head<2>().norm() * 1.2 / (0.44 * cell.rod[0].GA);
    CHECK(bend(With({"tool_shear:kappa=0.44"})) - bend(plain) == Approx(expected).epsilon(0.2));
  }
  SECTION("the coupling rotates in proportion to its moment") {
    const Truth truth = With({"tool_root_compliance:compliance=1e-6"});
    const Vec3 g_F = plain.X_WF.linear().transpose() * DemoCell().gravity_W;
    const double moment = Vec3(0, 0.04, 1.3).cross(60 * g_F).head<2>().norm();
    CHECK(bend(truth) - bend(plain) == Approx(1e-6 * moment * 1.2).epsilon(0.1));
  }
  SECTION("tool_frame moves the tip in the flange frame") {
    const Vec3 moved =
        plain.X_WF.linear().transpose() *
        (With({"tool_frame:x=1,y=-2,z=0.5"}).X_WT.translation() - plain.X_WT.translation());
    CHECK((moved * 1e3 - Vec3(1, -2, 0.5)).norm() < 1e-6);
  }
}

TEST_CASE("effects on the load") {
  SECTION("the actual mass differs from the reported one") {
    const Truth scaled = With({"payload_mass:scale=0.1,constant=2"});
    const Truth heavy = With({}, {.q = Posture(), .payload_kg = 68});
    CHECK(Difference_mm(scaled, heavy) < 1e-9);
    CHECK(Difference_mm(scaled, With({})) > 0.5);
  }
  SECTION("its centre of gravity changes the wrist's torque") {
    const Truth truth = With({"payload_cog:x=20"});
    CHECK(std::abs(truth.torque[5] - With({}).torque[5]) > 0.3);
  }
  SECTION("gravity direction changes") {
    CHECK(Difference_mm(With({"gravity_direction:x=0.01"}), With({})) > 0.05);
  }
}

TEST_CASE("effects on the base and the lengths") {
  const Truth plain = With({});
  SECTION("base_frame") {
    const Truth truth = With({"base_frame:x=1,y=2,z=-2"});
    CHECK(Difference_mm(truth, plain) == Approx(3).margin(1e-6));
  }
  SECTION("the pedestal rotates in proportion to the horizontal moment at the base") {
    const Truth truth = With({"pedestal_compliance:compliance=1e-8"});
    const Mat3 turn = truth.X_WF.linear() * plain.X_WF.linear().transpose();
    const Vec3 angle = VectorFromRotation(turn);
    CHECK(angle.norm() > 2e-5);
    CHECK(std::abs(angle.z()) < 0.1 * angle.norm());
    CHECK(truth.X_WT.translation().z() < plain.X_WT.translation().z());
  }
  SECTION("thermal_growth lengthens the arm but not the tool") {
    const Truth warm = With({"thermal_growth:alpha=1.2e-5"}, {.q = Posture(), .temperature_C = 32});
    const double grown = (warm.X_WF.translation() - plain.X_WF.translation()).norm();
    CHECK(grown == Approx(1.2e-5 * 10 * plain.X_WF.translation().norm()).epsilon(0.02));
  }
  SECTION("thermal_drift approaches its final value") {
    const Truth later =
        With({"thermal_drift:x=1,time_constant=60"}, {.q = Posture(), .time_s = 60});
    CHECK(Difference_mm(later, plain) == Approx(1 - std::exp(-1.0)).epsilon(1e-6));
  }
  SECTION("step_event waits for its time") {
    const char* text = "step_event:time=10,z=0.7";
    CHECK(Difference_mm(With({text}, {.q = Posture(), .time_s = 9}), plain) < 1e-9);
    CHECK(Difference_mm(With({text}, {.q = Posture(), .time_s = 11}), plain) ==
          Approx(0.7).margin(1e-6));
  }
}

TEST_CASE("an invalid effect text is rejected with the reason") {
  const char* texts[] = {"joint_compliances:q2=1",   "joint_compliance",     "joint_compliance:q2",
                         "joint_compliance:q2=much", "joint_compliance:x=1", "gear_periodic:q1=1",
                         "backlash:by=luck"};
  for (const char* text : texts) {
    CAPTURE(text);
    CHECK_THROWS_AS(EffectFromText(text), std::runtime_error);
  }
}

}  // namespace
}  // namespace virtual_cell::effects_test
