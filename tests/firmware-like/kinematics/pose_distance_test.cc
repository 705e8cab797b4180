#include "firmware-like/kinematics/pose_distance.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/firmware-like/test_cell.h"

namespace plumbline::pose_distance_test {

using namespace plumbline::kinematics;

namespace {

/// Two parallel joints, links of 1 m: the tip is 1 m from the second axis.
model::CellModel TwoJoints() {
  model::CellModel cell;
  for (int joint = 0; joint < 2; ++joint) {
    cell.robot.joints.push_back(test::MakeJoint(1.0, 0, 0, 0, -180, 180, 10, {-0.5, 0, 0}, 0));
  }
  return cell;
}

model::JointVector Pose2(double q1, double q2) {
  model::JointVector q(2);
  q << q1, q2;
  return q;
}

}  // namespace

TEST_CASE("the distance is the chord of the joint angles, weighted by their levers") {
  const Chain chain(TwoJoints().robot);
  const std::vector<model::JointVector> straight = {Pose2(0, 0)};  // levers 2 m and 1 m
  const PoseDistance distance(chain, Vec3::Zero(), straight);
  CHECK(distance.Of(Pose2(0, 0)) == Approx(0).margin(1e-12));
  CHECK(distance.Of(Pose2(1e-3, 0)) == Approx(1e-3 * std::sqrt(0.8)));
  CHECK(distance.Of(Pose2(0, 1e-3)) == Approx(1e-3 * std::sqrt(0.2)));
  CHECK(distance.Of(Pose2(std::numbers::pi, std::numbers::pi)) == Approx(2));
  CHECK(distance.Of(Pose2(2 * std::numbers::pi, 0)) == Approx(0).margin(1e-12));
  const std::vector<model::JointVector> both = {Pose2(0, 0), Pose2(0, 2)};
  CHECK(PoseDistance(chain, Vec3::Zero(), both).Of(Pose2(0, 2)) == Approx(0).margin(1e-12));
}

TEST_CASE("the distance of coupled axes is that of the axes") {
  model::CellModel cell = TwoJoints();
  const std::vector<model::JointVector> straight = {Pose2(0, 0)};
  const PoseDistance uncoupled(Chain(cell.robot), Vec3::Zero(), straight);
  cell.robot.couplings = {{1, 0, 0.5}};
  const Chain chain(cell.robot);
  const PoseDistance coupled(chain, Vec3::Zero(), straight);
  CHECK(coupled.Of(Pose2(0.6, 0.2)) == Approx(uncoupled.Of(Pose2(0.6, 0.5))));
  // A turn of the first joint turns the second axis half: another posture.
  CHECK(coupled.Of(Pose2(2 * std::numbers::pi, 0)) == Approx(2 * std::sqrt(0.2)));
  CHECK_FALSE(chain.RepeatsAfterTurn(0));
  CHECK(chain.RepeatsAfterTurn(1));
}

TEST_CASE("the distance to an empty set is zero") {
  CHECK(PoseDistance(Chain(TwoJoints().robot), Vec3::Zero(), {}).Of(Pose2(1, 1)) == 0);
}

TEST_CASE("a prismatic joint contributes its travel relative to the levers; alone, in metres") {
  model::CellModel cell = TwoJoints();
  cell.robot.joints[0].type = model::JointType::kPrismatic;
  const std::vector<model::JointVector> origin = {Pose2(0, 0)};
  const PoseDistance mixed(Chain(cell.robot), Vec3::Zero(), origin);  // the other lever: 1 m
  CHECK(mixed.Of(Pose2(0.3, 0)) == Approx(0.3));
  cell.robot.joints[1].type = model::JointType::kPrismatic;
  const PoseDistance gantry(Chain(cell.robot), Vec3::Zero(), origin);
  CHECK(gantry.Of(Pose2(0.3, 0.4)) == Approx(0.5));
}

}  // namespace plumbline::pose_distance_test
