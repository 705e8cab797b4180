// Reachability and sag of the demo cell.
#include <catch2/catch.hpp>

#include "tests/virtual_cell/controller.h"
#include "tests/virtual_cell/world.h"

namespace virtual_cell::demo_test {
namespace {

CellDescription DemoCell() {
  return ReadCellFile("tests/virtual_cell/demo/cockpit-cell.toml");
}
MotionProgram DemoProgram() {
  return ReadProgramFile("tests/virtual_cell/demo/cockpit-program.toml");
}

/// Linear model of the cell formats: s = c tau with all loads on the straight tool, then the
/// small-displacement cantilever. Implemented here from the format description, to quantify how far
/// the world deviates from it.
Vec3 LinearTip(const CellDescription& cell, const Joints& q, double payload_kg) {
  const Arm arm = ArmFromDescription(cell);
  Joints s = Joints::Zero(q.size());
  for (int pass = 0; pass < 50; ++pass) {
    Joints tau(q.size());
    for (int i = 0; i < q.size(); ++i) {
      const double h = 1e-4;
      Joints up = q + s, down = q + s;
      up[i] += h;
      down[i] -= h;
      tau[i] = -(GravityEnergyStraightTool(cell, up, payload_kg) -
                 GravityEnergyStraightTool(cell, down, payload_kg)) /
               (2 * h);
      s[i] = cell.joints[static_cast<std::size_t>(i)].compliance * tau[i];
    }
  }
  const Motion X_BF = PostureAt(arm, q + s).links.back();
  const Vec3 g = X_BF.linear().transpose() * cell.gravity_W;
  const RodSegment& rod = cell.rod.front();
  const double L = rod.length_m;
  const Vec3 F = payload_kg * g, w = rod.weight_kg_m * g;
  const Vec3 M = (cell.payload_cog_F - Vec3(0, 0, L)).cross(F);
  const Vec3 d(F.x() * L * L * L / (3 * rod.EI_y) + M.y() * L * L / (2 * rod.EI_y) +
                   w.x() * L * L * L * L / (8 * rod.EI_y),
               F.y() * L * L * L / (3 * rod.EI_x) - M.x() * L * L / (2 * rod.EI_x) +
                   w.y() * L * L * L * L / (8 * rod.EI_x),
               0);
  return cell.X_WB * (X_BF * (Vec3(0, 0, L) + d));
}

TEST_CASE("the controller reaches every point of the demo, elbow up, away from its limits") {
  const CellDescription cell = DemoCell();
  const MotionProgram program = DemoProgram();
  Controller controller(cell, program.home);
  for (const ProgramStep& step : program.steps) {
    if (step.kind != ProgramStep::Kind::kMove) continue;
    CAPTURE(step.point);
    REQUIRE(controller.MoveToPose(program.Find(step.point)->TipInBase()) == MoveAnswer::kAccepted);
    controller.Advance(1e3);
    INFO("q [deg] " << (controller.q() * DegFromRad(1)).transpose());
    const Posture posture = PostureAt(ArmFromDescription(cell), controller.q());
    const double elbow = posture.links[1].translation().z();
    const double shoulder = posture.links[0].translation().z();
    const double wrist = posture.links[4].translation().z();
    CHECK(elbow > shoulder + (wrist - shoulder) / 2);
    for (int i = 0; i < cell.size(); ++i) {
      const JointDescription& joint = cell.joints[static_cast<std::size_t>(i)];
      CHECK(controller.q()[i] > joint.min + 0.05);
      CHECK(controller.q()[i] < joint.max - 0.05);
    }
    // Within the range of 16-bit registers with 0.1 mm resolution.
    CHECK(controller.NominalTipPose().translation().cwiseAbs().maxCoeff() < 3.2767);
  }
}

TEST_CASE("the loaded tip sags by millimetres; the world deviates far less from the linear model") {
  const CellDescription cell = DemoCell();
  const MotionProgram program = DemoProgram();
  const World world(cell);
  Controller controller(cell, program.home);
  for (const TaughtPoint& point : program.points) {
    CAPTURE(point.name);
    REQUIRE(controller.MoveToPose(point.TipInBase()) == MoveAnswer::kAccepted);
    controller.Advance(1e3);
    const Truth truth = world.Settle({.q = controller.q(), .payload_kg = 60});
    REQUIRE(truth.converged);
    const Vec3 sag_mm =
        1e3 * (truth.X_WT.translation() - controller.NominalTipPose().translation());
    const Vec3 beyond_mm = 1e3 * (truth.X_WT.translation() - LinearTip(cell, controller.q(), 60));
    const Vec3 tilt =
        VectorFromRotation(truth.X_WT.linear() * controller.NominalTipPose().linear().transpose());
    INFO(point.name << ": sag [mm] " << sag_mm.transpose() << ", beyond the linear model [mm] "
                    << beyond_mm.norm() << " (" << beyond_mm.transpose() << "), tilt [mrad] "
                    << 1e3 * tilt.transpose() << ", tau [N m] " << truth.torque.transpose());
    CHECK(sag_mm.z() < -3);
    CHECK(sag_mm.z() > -40);
    CHECK(beyond_mm.norm() > 1e-4);
    CHECK(beyond_mm.norm() < 0.2);
  }
}

}  // namespace
}  // namespace virtual_cell::demo_test
