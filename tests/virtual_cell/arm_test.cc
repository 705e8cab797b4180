// Screw kinematics, torques by virtual work, inverse kinematics of the controller.
#include "tests/virtual_cell/arm.h"

#include <catch2/catch.hpp>
#include <random>

#include "tests/virtual_cell/controller.h"
#include "tests/virtual_cell/world.h"

namespace virtual_cell::arm_test {
namespace {

CellDescription DemoCell() {
  return ReadCellFile("tests/virtual_cell/demo/cockpit-cell.toml");
}

Joints Degrees(std::initializer_list<double> degrees) {
  Joints q(static_cast<Eigen::Index>(degrees.size()));
  Eigen::Index i = 0;
  for (const double degree : degrees) q[i++] = RadFromDeg(degree);
  return q;
}

/// Two links in a plane, as "mdh" rows, the second joint optionally prismatic.
CellDescription Planar(bool prismatic) {
  CellDescription cell;
  cell.proximal_dh = true;
  cell.joints.resize(2);
  cell.joints[1].a_m = 2;
  cell.joints[1].prismatic = prismatic;
  cell.joints[1].link_mass_kg = 3;
  cell.joints[1].link_com_m = {1, 0, 0};
  cell.gravity_W = {0, -10, 0};
  return cell;
}

TEST_CASE("the demo arm matches its data sheet") {
  const Arm arm = ArmFromDescription(DemoCell());
  SECTION("A2 = A3 = 0: stretched forward") {
    const Motion flange = PostureAt(arm, Joints::Zero(6)).links.back();
    CHECK((flange.translation() - Vec3(0.35 + 1.15 + 1.2 + 0.215, 0, 0.675 - 0.041)).norm() <
          1e-12);
    CHECK((flange.linear() * Vec3::UnitZ() - Vec3::UnitX()).norm() < 1e-12);
  }
  SECTION("A2 = -90, A3 = 90: link arm upright, forearm level") {
    const Motion flange = PostureAt(arm, Degrees({0, -90, 90, 0, 0, 0})).links.back();
    CHECK((flange.translation() - Vec3(0.35 + 1.2 + 0.215, 0, 0.675 + 1.15 - 0.041)).norm() <
          1e-12);
  }
  SECTION("A1 = 90 turns clockwise seen from above") {
    const Motion flange = PostureAt(arm, Degrees({90, 0, 0, 0, 0, 0})).links.back();
    CHECK(flange.translation().y() == Approx(-2.915));
  }
}

TEST_CASE("modified rows and a prismatic joint") {
  SECTION("two turns") {
    const Posture posture = PostureAt(ArmFromDescription(Planar(false)), Degrees({90, -90}));
    CHECK((posture.links[1] * Vec3(1, 0, 0) - Vec3(1, 2, 0)).norm() < 1e-12);
  }
  SECTION("a slide along z") {
    Joints q(2);
    q << 0, 0.25;
    const Posture posture = PostureAt(ArmFromDescription(Planar(true)), q);
    CHECK((posture.links[1].translation() - Vec3(2, 0, 0.25)).norm() < 1e-12);
  }
  SECTION("its torques: lever times weight") {
    const World world(Planar(false));
    const Truth truth = world.Settle({.q = Joints::Zero(2)});
    CHECK(truth.torque[0] == Approx(-3 * 10 * 3));
    CHECK(truth.torque[1] == Approx(-1 * 10 * 3));
  }
}

TEST_CASE("torques are the derivative of the energy for a nearly rigid tool") {
  CellDescription cell = DemoCell();
  for (RodSegment& rod : cell.rod) {
    rod.EI_x *= 1e6;
    rod.EI_y *= 1e6;
    rod.GJ *= 1e6;
  }
  for (JointDescription& joint : cell.joints) joint.compliance = 0;
  const World world(cell);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (int trial = 0; trial < 20; ++trial) {
    Joints q(6);
    for (double& value : q) value = angle(random);
    const Truth truth = world.Settle({.q = q, .payload_kg = 60});
    REQUIRE(truth.converged);
    for (int i = 0; i < 6; ++i) {
      const double h = 1e-4;
      Joints up = q, down = q;
      up[i] += h;
      down[i] -= h;
      const double by_energy =
          -(GravityEnergyStraightTool(cell, up, 60) - GravityEnergyStraightTool(cell, down, 60)) /
          (2 * h);
      CHECK(truth.torque[i] == Approx(by_energy).margin(0.01));
    }
  }
}

TEST_CASE("inverse kinematics inverts forward kinematics within the limits") {
  const CellDescription cell = DemoCell();
  const Arm arm = ArmFromDescription(cell);
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    Joints q(6), start(6);
    for (int i = 0; i < 6; ++i) {
      const JointDescription& joint = cell.joints[static_cast<std::size_t>(i)];
      q[i] = std::uniform_real_distribution<double>(std::max(joint.min, -2.0),
                                                    std::min(joint.max, 2.0))(random);
      start[i] = q[i] + std::uniform_real_distribution<double>(-0.3, 0.3)(random);
      start[i] = std::clamp(start[i], joint.min, joint.max);
    }
    const Motion wanted = NominalTip(cell, arm, q);
    const std::optional<Joints> found = SolveInverseKinematics(cell, arm, wanted, start);
    REQUIRE(found);
    const Motion reached = NominalTip(cell, arm, *found);
    CHECK((reached.translation() - wanted.translation()).norm() < 1e-8);
    CHECK(VectorFromRotation(reached.linear() * wanted.linear().transpose()).norm() < 1e-8);
    for (int i = 0; i < 6; ++i) {
      CHECK((*found)[i] >= cell.joints[static_cast<std::size_t>(i)].min);
      CHECK((*found)[i] <= cell.joints[static_cast<std::size_t>(i)].max);
    }
  }
}

TEST_CASE("a pose out of reach is refused, and so are joints outside their limits") {
  const CellDescription cell = DemoCell();
  Controller controller(cell, Degrees({0, -100, 110, 0, -10, 0}));
  CHECK(controller.MoveToPose(MotionFromXyzVector({6, 0, 1}, Vec3::Zero())) ==
        MoveAnswer::kUnreachable);
  CHECK(controller.MoveToJoints(Degrees({0, 10, 110, 0, -10, 0})) == MoveAnswer::kOutsideLimits);
  CHECK_FALSE(controller.Moving());
}

TEST_CASE("a motion ends at its target and respects its limits") {
  const MotionLimits limits{.speed = 0.5, .acceleration = 1.5};
  Controller controller(DemoCell(), Degrees({0, -100, 110, 0, -10, 0}), limits);
  const Joints goal = Degrees({40, -80, 90, 20, 30, -50});
  REQUIRE(controller.MoveToJoints(goal) == MoveAnswer::kAccepted);
  const double dt = 1e-3;
  double fastest = 0, hardest = 0;
  Joints before = controller.speed();
  for (int i = 0; controller.Moving() && i < 100000; ++i) {
    controller.Advance(dt);
    fastest = std::max(fastest, controller.speed().cwiseAbs().maxCoeff());
    hardest = std::max(hardest, (controller.speed() - before).cwiseAbs().maxCoeff() / dt);
    before = controller.speed();
  }
  CHECK(controller.q() == goal);
  CHECK(fastest < limits.speed * 1.001);
  CHECK(fastest > limits.speed * 0.9);
  CHECK(hardest < limits.acceleration * 1.01);
}

}  // namespace
}  // namespace virtual_cell::arm_test
