#include "firmware-like/loads/gravity.h"

#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

namespace plumbline::gravity_test {

using namespace plumbline::loads;

namespace {

/// Work of gravity: sum of m g . r over all masses of the cell, in B.
double GravityWork(const model::CellModel& cell, const Payload& payload, const Vec3& g_B,
                   const model::JointVector& q) {
  const kinematics::Chain chain(cell.robot);
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  double work = 0;
  for (std::size_t i = 0; i < cell.robot.joints.size(); ++i) {
    const model::Joint& joint = cell.robot.joints[i];
    work += *joint.link_mass_kg * g_B.dot(posture.X_BL[i] * *joint.link_com_m);
  }
  const Pose& X_BF = posture.X_BF();
  const double length_m = cell.tool.Length();
  double z_m = 0;
  for (const model::ToolSegment& segment : cell.tool.segments) {
    const double mass_kg =
        segment.length_m * segment.section.area_m2 * segment.material.density_kg_m3;
    work += mass_kg * g_B.dot(X_BF * Vec3(0, 0, z_m + segment.length_m / 2));
    z_m += segment.length_m;
  }
  work += cell.tool.mount_mass_kg * g_B.dot(X_BF * Vec3(0, 0, length_m / 2));
  return work + payload.mass_kg * g_B.dot(X_BF * payload.cog_F);
}

}  // namespace

TEST_CASE("gravity torques are the derivative of the work of gravity (virtual work)") {
  std::mt19937 random(9);
  model::CellModel cell = test::HeavyArm();
  model::ToolSegment thin = cell.tool.segments[0];
  thin.length_m = 0.4;
  thin.section = model::SquareTubeSection(0.05, 0.004);
  cell.tool.segments.push_back(thin);
  model::Joint rail;
  rail.type = model::JointType::kPrismatic;
  rail.alpha_rad = 0.4;
  rail.sign = -1;
  rail.min = -2;
  rail.max = 2;
  rail.link_mass_kg = 500;
  rail.link_com_m = Vec3(0.1, 0.2, 0.3);
  cell.robot.joints.insert(cell.robot.joints.begin(), rail);
  const GravityLoads loads(cell);
  REQUIRE(loads.known(0));
  CHECK_FALSE(loads.guessed(0));
  const Vec3 g_B(0.3, -0.5, -9.7);
  const Payload payload{60, Vec3(0.05, -0.1, 1.3)};
  const kinematics::Chain chain(cell.robot);
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 20; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    kinematics::Posture posture;
    chain.Evaluate(q, posture);
    model::JointVector tau;
    loads.Torques(posture, g_B, payload, tau);
    for (int i = 0; i < q.size(); ++i) {
      model::JointVector ahead = q, behind = q;
      ahead[i] += kStep;
      behind[i] -= kStep;
      const double expected =
          (GravityWork(cell, payload, g_B, ahead) - GravityWork(cell, payload, g_B, behind)) /
          (2 * kStep);
      CHECK(tau[i] == Approx(expected).margin(1e-4));
    }
  }
}

TEST_CASE(
    "a link without mass makes the torques up to it unknown; one without centre makes them "
    "guessed") {
  model::CellModel cell = test::HeavyArm();
  cell.robot.joints[3].link_com_m.reset();
  CHECK(GravityLoads(cell).guessed(3));
  CHECK_FALSE(GravityLoads(cell).guessed(4));
  CHECK(GravityLoads(cell).known(0));
  cell.robot.joints[3].link_mass_kg = 0;
  CHECK_FALSE(GravityLoads(cell).guessed(0));  // a link of zero mass needs no centre
  cell.robot.joints[3].link_mass_kg.reset();
  CHECK_FALSE(GravityLoads(cell).known(0));
  CHECK_FALSE(GravityLoads(cell).known(3));
  CHECK(GravityLoads(cell).known(4));
}

}  // namespace plumbline::gravity_test
