// A Universal Robots calibration as a cell.
#include "app/measure/urdf/ur_kinematics.h"

#include <catch2/catch.hpp>

#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/dh_table.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::ur_kinematics_test {
namespace {

/// Invented deviations about the published UR5e lengths.
const std::string kText = R"(kinematics:
  shoulder: {x: 0, y: 0, z: 0.16251, roll: -0, pitch: 0, yaw: -3.2e-05}
  upper_arm: {x: -0.00011, y: 0, z: 0, roll: 1.5703, pitch: 0, yaw: 2.1e-05}
  forearm: {x: -0.42531, y: 0, z: 0, roll: 0.0014, pitch: -0.0006, yaw: 1.2e-05}
  wrist_1: {x: -0.39201, y: -0.00012, z: 0.13343, roll: 3.1409, pitch: 3.1411, yaw: 3.14159}
  wrist_2:
    x: 7.4e-05
    y: -0.09964
    z: -8.2e-05
    roll: 1.5716
    pitch: 0
    yaw: -1.6e-05
  wrist_3: {x: -4.4e-05, y: 0.09962, z: 3.1e-05, roll: 1.5704, pitch: 3.14159, yaw: 3.1416}
  hash: calib_12788084448423163542
)";

/// Flange of the file's arm by elementary rotations; joint k turns about z of its origin.
Eigen::Isometry3d Flange(const double (&rows)[6][6], const model::JointVector& q, bool xyz) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 6; ++i) {
    const auto& r = rows[i];
    const Eigen::AngleAxisd Rx(r[3], Vec3::UnitX()), Ry(r[4], Vec3::UnitY()),
        Rz(r[5], Vec3::UnitZ());
    const Eigen::Quaterniond R = xyz ? Rx * Ry * Rz : Rz * Ry * Rx;
    X = X * Eigen::Translation3d(r[0], r[1], r[2]) * R * Eigen::AngleAxisd(q[i], Vec3::UnitZ());
  }
  return X;
}

constexpr double kRows[6][6] = {{0, 0, 0.16251, 0, 0, -3.2e-05},
                                {-0.00011, 0, 0, 1.5703, 0, 2.1e-05},
                                {-0.42531, 0, 0, 0.0014, -0.0006, 1.2e-05},
                                {-0.39201, -0.00012, 0.13343, 3.1409, 3.1411, 3.14159},
                                {7.4e-05, -0.09964, -8.2e-05, 1.5716, 0, -1.6e-05},
                                {-4.4e-05, 0.09962, 3.1e-05, 1.5704, 3.14159, 3.1416}};

}  // namespace

TEST_CASE("a UR calibration becomes a cell with the same forward kinematics") {
  CHECK(measure::IsUrKinematics(kText));
  CHECK_FALSE(measure::IsUrKinematics("<robot/>"));
  for (const measure::UrAngles angles :
       {measure::UrAngles::kRollPitchYaw, measure::UrAngles::kXyz}) {
    config::FaultList faults;
    const auto chain = measure::ChainFromUrKinematics(kText, "k.yaml", angles, faults);
    INFO(config::FaultsText(faults));
    REQUIRE(chain);
    const model::Robot robot = measure::RobotFromChain(*chain);
    const kinematics::Chain table(robot);
    double farthest_m = 0;
    for (const model::JointVector& q : measure::RandomPostures(robot, 1000)) {
      kinematics::Posture posture;
      table.Evaluate(q, posture);
      const Eigen::Isometry3d expected = Flange(kRows, q, angles == measure::UrAngles::kXyz);
      const Pose X = robot.X_WB * posture.X_BF();
      farthest_m = std::max(farthest_m, (X.p - expected.translation()).norm());
      REQUIRE((X.R - expected.linear()).norm() < 1e-12);
    }
    CHECK(farthest_m < 1e-12);
    // Between the parallel axes, rows of the arm's size rather than of hundreds of metres.
    for (const model::Joint& row : robot.joints) CHECK(std::hypot(row.a_m, row.d_m) < 0.6);
    CHECK(robot.joints[1].beta_rad != 0);
  }
}

TEST_CASE("a faulty UR calibration is refused with key, line and value") {
  const auto faults_of = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    config::FaultList faults;
    CHECK_FALSE(measure::ChainFromUrKinematics(text, "k.yaml", measure::UrAngles::kXyz, faults));
    return config::FaultsText(faults);
  };
  using Catch::Contains;
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: wrong"),
             Contains("k.yaml:8 kinematics.wrist_2.y: \"wrong\" is not a finite number"));
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: .nan"), Contains("\".nan\" is not"));
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: -99640"), Contains("is outside -100..100"));
  CHECK_THAT(faults_of(kText, "    y: -0.09964\n", ""), Contains("kinematics.wrist_2.y: missing"));
  CHECK_THAT(faults_of(kText, "{x: 0,", "{x: 0"), Contains("is not"));
}

}  // namespace plumbline::ur_kinematics_test
