#include "firmware-like/kinematics/chain.h"

#include <catch2/catch.hpp>

#include "firmware-like/geometry/rotation.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::chain_test {

using namespace plumbline::kinematics;

namespace {

/// The product of elementary transforms, written with Eigen's types.
Eigen::Isometry3d FlangeByTransforms(const model::Robot& robot, const model::JointVector& q) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (int i = 0; i < robot.size(); ++i) {
    const model::Joint& joint = robot.joints[static_cast<std::size_t>(i)];
    const bool turns = joint.type == model::JointType::kRevolute;
    const double theta = joint.theta_offset_rad + (turns ? joint.sign * q[i] : 0);
    const double d = joint.d_m + (turns ? 0 : joint.sign * q[i]);
    const Eigen::AngleAxisd Rz(theta, Vec3::UnitZ()), Rx(joint.alpha_rad, Vec3::UnitX());
    const Eigen::Translation3d Tz(0, 0, d), Tx(joint.a_m, 0, 0);
    const Eigen::AngleAxisd Ry(joint.beta_rad, Vec3::UnitY()), end(joint.gamma_rad, Vec3::UnitZ());
    if (robot.convention == model::DhConvention::kDistal) {
      X = X * Rz * Tz * Tx * Rx * Ry * end;
    } else {
      X = X * Rx * Tx * Ry * Rz * Tz;
    }
  }
  return X;
}

model::Robot MixedArm(model::DhConvention convention) {
  model::Robot robot;
  robot.convention = convention;
  for (int i = 0; i < 7; ++i) {
    model::Joint joint;
    joint.a_m = 0.1 * i - 0.2;
    joint.alpha_rad = 0.7 * i - 1.5;
    joint.beta_rad = i % 3 == 1 ? 0.3 : 0;
    if (convention == model::DhConvention::kDistal && i > 3) joint.gamma_rad = 0.4 * i;
    joint.d_m = 0.3 - 0.05 * i;
    joint.theta_offset_rad = 0.2 * i;
    joint.sign = i % 2 == 0 ? 1 : -1;
    if (i == 2 || i == 5) joint.type = model::JointType::kPrismatic;
    robot.joints.push_back(joint);
  }
  return robot;
}

}  // namespace

TEST_CASE("flange pose equals the product of elementary transforms") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (const model::DhConvention convention :
       {model::DhConvention::kDistal, model::DhConvention::kProximal}) {
    const model::Robot robot = MixedArm(convention);
    const Chain chain(robot);
    for (int trial = 0; trial < 50; ++trial) {
      model::JointVector q(robot.size());
      for (double& value : q) value = uniform(random);
      Posture posture;
      chain.Evaluate(q, posture);
      const Eigen::Isometry3d expected = FlangeByTransforms(robot, q);
      CHECK((posture.X_BF().p - expected.translation()).norm() < 1e-12);
      CHECK((posture.X_BF().R - expected.linear()).norm() < 1e-12);
    }
  }
}

TEST_CASE("coupled axes: flange and Jacobian are those of the arm at the axes' positions") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (const model::DhConvention convention :
       {model::DhConvention::kDistal, model::DhConvention::kProximal}) {
    model::Robot robot = MixedArm(convention);
    robot.couplings = {{4, 3, -0.5}, {3, 1, 0.8}, {2, 6, 0.1}, {3, 0, 1}};
    const Chain chain(robot);
    for (int trial = 0; trial < 20; ++trial) {
      model::JointVector q(7);
      for (double& value : q) value = uniform(random);
      model::JointVector axes = q;
      axes[2] = q[2] + 0.1 * q[6];
      axes[3] = q[3] + 0.8 * q[1] + q[0];
      axes[4] = q[4] - 0.5 * q[3];
      CHECK((chain.AxisPositions<double>(q) - axes).norm() < 1e-14);
      CHECK((chain.ReportedFromAxes<double>(axes) - q).norm() < 1e-14);
      Posture posture;
      chain.Evaluate(q, posture);
      const Eigen::Isometry3d expected = FlangeByTransforms(robot, axes);
      CHECK((posture.X_BF().p - expected.translation()).norm() < 1e-12);
      CHECK((posture.X_BF().R - expected.linear()).norm() < 1e-12);

      const Vec3 p_FQ(0.1, -0.2, 0.4);
      Jacobian jacobian;
      chain.JacobianAt(posture, posture.X_BF() * p_FQ, jacobian);
      for (int joint = 0; joint < 7; ++joint) {
        constexpr double kStep = 1e-6;
        Posture more, less;
        chain.Evaluate(q + kStep * model::JointVector::Unit(7, joint), more);
        chain.Evaluate(q - kStep * model::JointVector::Unit(7, joint), less);
        const Vec3 moved = (more.X_BF() * p_FQ - less.X_BF() * p_FQ) / (2 * kStep);
        const Vec3 turned =
            VectorFromRotation(more.X_BF().R * less.X_BF().R.transpose()) / (2 * kStep);
        CHECK((jacobian.col(joint).head<3>() - moved).norm() < 1e-8);
        CHECK((jacobian.col(joint).tail<3>() - turned).norm() < 1e-8);
      }
    }
  }
}

TEST_CASE("joints on a cycle of couplings, and those that depend on one, have no order") {
  CHECK(CouplingOrder(3, {}) == std::vector{0, 1, 2});
  CHECK(CouplingOrder(4, {{0, 2, 1.0}, {2, 3, 1.0}}) == std::vector{1, 3, 2, 0});
  CHECK(CouplingOrder(4, {{1, 2, 1.0}, {2, 1, 1.0}, {3, 1, 1.0}}) == std::vector{0});
  CHECK(CouplingOrder(2, {{1, 1, 1.0}}) == std::vector{0});
}

TEST_CASE("beta rotates about y after the twist, in both conventions") {
  for (const model::DhConvention convention :
       {model::DhConvention::kDistal, model::DhConvention::kProximal}) {
    model::Robot robot;
    robot.convention = convention;
    robot.joints.resize(1);
    model::Joint& joint = robot.joints.front();
    joint.a_m = 0.4;
    joint.alpha_rad = 0.7;
    joint.d_m = 0.3;
    const Chain chain(robot);
    const double none = 0, beta = 0.2;
    const DhChanges<double> changes{&none, &none, &none, &beta};
    model::JointVector q(1);
    q << -0.9;
    PostureOf<double> posture;
    chain.Evaluate<double>(q, &changes, posture);
    const Eigen::AngleAxisd Rz(q[0], Vec3::UnitZ()), Rx(0.7, Vec3::UnitX()), Ry(0.2, Vec3::UnitY());
    const Eigen::Translation3d Tz(0, 0, 0.3), Tx(0.4, 0, 0);
    const Eigen::Isometry3d expected = convention == model::DhConvention::kDistal
                                           ? Eigen::Isometry3d(Rz * Tz * Tx * Rx * Ry)
                                           : Eigen::Isometry3d(Rx * Tx * Ry * Rz * Tz);
    CHECK((posture.X_BF().R - expected.rotation()).norm() < 1e-14);
    CHECK((posture.X_BF().p - expected.translation()).norm() < 1e-14);
  }
}

TEST_CASE("the Jacobian equals finite differences of the pose") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  constexpr double kStep = 1e-6;
  for (const model::DhConvention convention :
       {model::DhConvention::kDistal, model::DhConvention::kProximal}) {
    const model::Robot robot = MixedArm(convention);
    const Chain chain(robot);
    const Vec3 p_FQ(0.1, -0.2, 0.5);
    model::JointVector q(robot.size());
    for (double& value : q) value = uniform(random);
    Posture posture;
    chain.Evaluate(q, posture);
    Jacobian jacobian;
    chain.JacobianAt(posture, posture.X_BF() * p_FQ, jacobian);
    for (int i = 0; i < robot.size(); ++i) {
      model::JointVector ahead = q, behind = q;
      ahead[i] += kStep;
      behind[i] -= kStep;
      Posture after, before;
      chain.Evaluate(ahead, after);
      chain.Evaluate(behind, before);
      const Vec3 velocity = (after.X_BF() * p_FQ - before.X_BF() * p_FQ) / (2 * kStep);
      const Vec3 turning =
          VectorFromRotation(after.X_BF().R * before.X_BF().R.transpose()) / (2 * kStep);
      CHECK((jacobian.col(i).head<3>() - velocity).norm() < 1e-8);
      CHECK((jacobian.col(i).tail<3>() - turning).norm() < 1e-8);
    }
  }
}

TEST_CASE("the reach bounds every flange position") {
  std::mt19937 random(4);
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  for (int trial = 0; trial < 1000; ++trial) {
    Posture posture;
    chain.Evaluate(test::RandomPosture(cell, random), posture);
    CHECK(posture.X_BF().p.norm() <= chain.Reach());
  }
}

}  // namespace plumbline::chain_test
