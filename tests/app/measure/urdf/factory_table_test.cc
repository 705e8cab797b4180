// Factory tables of joint frames as cells.
#include "app/measure/urdf/factory_table.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/dh_table.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::factory_table_test {
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
  CHECK(measure::IsFactoryTable(kText));
  CHECK_FALSE(measure::IsFactoryTable("<robot/>"));
  for (const measure::TableAngles angles :
       {measure::TableAngles::kRollPitchYaw, measure::TableAngles::kXyz}) {
    config::FaultList faults;
    const auto chain = measure::ChainFromFactoryTable(kText, "k.yaml", angles, faults);
    INFO(config::FaultsText(faults));
    REQUIRE(chain);
    const model::Robot robot = measure::RobotFromChain(*chain);
    const kinematics::Chain table(robot);
    double farthest_m = 0;
    for (const model::JointVector& q : measure::RandomPostures(robot, 1000)) {
      kinematics::Posture posture;
      table.Evaluate(q, posture);
      const Eigen::Isometry3d expected = Flange(kRows, q, angles == measure::TableAngles::kXyz);
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
    CHECK_FALSE(measure::ChainFromFactoryTable(text, "k.yaml", measure::TableAngles::kXyz, faults));
    return config::FaultsText(faults);
  };
  using Catch::Contains;
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: wrong"),
             Contains("k.yaml:8 kinematics.wrist_2.y: \"wrong\" is not a finite number"));
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: .nan"), Contains("\".nan\" is not"));
  CHECK_THAT(faults_of(kText, "y: -0.09964", "y: -99640"), Contains("is outside -10..10"));
  CHECK_THAT(faults_of(kText, "    y: -0.09964\n", ""),
             Contains("k.yaml:7 kinematics.wrist_2: has no y; the frame of a joint has"));
  CHECK_THAT(faults_of(kText, "{x: 0,", "{x: 0"), Contains("is not"));
}

TEST_CASE("a table of joint frames under any names becomes a cell, ordered by their numbers") {
  // Written backwards; six invented frames and a seventh.
  std::string text = "kinematics:\n";
  double rows[7][6] = {};
  for (int i = 7; i >= 1; --i) {
    double(&r)[6] = rows[i - 1];
    for (int k = 0; k < 6; ++k) r[k] = (k < 3 ? 0.2 : 1.5) * std::sin(7.0 * i + k);
    text += fmt::format("  joint{}: {{x: {}, y: {}, z: {}, roll: {}, pitch: {}, yaw: {}}}\n", i,
                        r[0], r[1], r[2], r[3], r[4], r[5]);
  }
  config::FaultList faults;
  const auto chain =
      measure::ChainFromFactoryTable(text, "k.yaml", measure::TableAngles::kRollPitchYaw, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(chain);
  CHECK(faults.All().empty());
  REQUIRE(chain->joints.size() == 7);
  CHECK(chain->joints.front().name == "joint1");
  const model::Robot robot = measure::RobotFromChain(*chain);
  const kinematics::Chain table(robot);
  for (const model::JointVector& q : measure::RandomPostures(robot, 100)) {
    kinematics::Posture posture;
    table.Evaluate(q, posture);
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 7; ++i) {
      const auto& r = rows[i];
      X = X * Eigen::Translation3d(r[0], r[1], r[2]) * Eigen::AngleAxisd(r[5], Vec3::UnitZ()) *
          Eigen::AngleAxisd(r[4], Vec3::UnitY()) * Eigen::AngleAxisd(r[3], Vec3::UnitX()) *
          Eigen::AngleAxisd(q[i], Vec3::UnitZ());
    }
    CHECK(((robot.X_WB * posture.X_BF()).p - X.translation()).norm() < 1e-12);
  }
}

TEST_CASE(
    "the joints of a chain are the axes: a coupling of the cell applies to its postures only") {
  config::FaultList faults;
  const auto chain =
      measure::ChainFromFactoryTable(kText, "k.yaml", measure::TableAngles::kRollPitchYaw, faults);
  REQUIRE(chain);
  model::Robot robot = measure::RobotFromChain(*chain);
  robot.couplings = {{2, 1, 1.0}};
  CHECK(measure::DifferenceOf(*chain, robot, measure::RandomPostures(robot, 100)).IsRounding());
}

TEST_CASE("a table that is no arm gets one message") {
  const auto faults_of = [](const std::string& text) {
    config::FaultList faults;
    CHECK_FALSE(measure::ChainFromFactoryTable(text, "k.yaml", measure::TableAngles::kRollPitchYaw,
                                               faults));
    CHECK(faults.All().size() == 1);
    return config::FaultsText(faults);
  };
  using Catch::Contains;
  const std::string frame = "{x: 0, y: 0, z: 0.1, roll: 0, pitch: 0, yaw: 0}\n";
  CHECK_THAT(faults_of("kinematics:\n  solver: KDL\n"), Contains("has no frames of joints"));
  CHECK_THAT(faults_of("a:\n  j1: " + frame + "b:\n  j2: " + frame), Contains("leave one table"));
  CHECK_THAT(faults_of("k:\n  arm1: " + frame + "  joint1: " + frame), Contains("of one number"));
  CHECK_THAT(faults_of("k:\n  j1: {x: 0, y: 0, z: 0, roll: -90, pitch: 0, yaw: 0}\n"),
             Contains("convert degrees"));
  CHECK_THAT(faults_of("k:\n  j1: {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0, offset: 1}\n"),
             Contains("k.j1.offset: is not part of a joint's frame"));
  std::string many = "k:\n";
  for (int i = 1; i <= 13; ++i) many += fmt::format("  j{}: {}", i, frame);
  CHECK_THAT(faults_of(many), Contains("has 13 joint frames"));
  // Frames of something else, and tables that lack a joint.
  CHECK_THAT(faults_of("static_transforms:\n  camera: " + frame + "  gripper: " + frame),
             Contains("has a frame \"camera\" (line 2) without a number"));
  CHECK_THAT(faults_of("k:\n  joint1: " + frame + "  tool: " + frame),
             Contains("\"tool\" (line 3)"));
  CHECK_THAT(faults_of("k:\n  j3: " + frame + "  j5: " + frame), Contains("starts with j3"));
  CHECK_THAT(faults_of("k:\n  j1: " + frame + "  j2: " + frame + "  j4: " + frame),
             Contains("has no frame between j2 (line 3) and j4 (line 4)"));
  std::string ur = kText;
  const std::size_t forearm = ur.find("  forearm");
  ur.erase(forearm, ur.find("  wrist_1") - forearm);
  CHECK_THAT(faults_of(ur), Contains("lacks the frame of forearm"));
  CHECK_THAT(faults_of(kText + "  joint7: " + frame), Contains("\"joint7\""));
  config::FaultList faults;
  CHECK(measure::ChainFromFactoryTable("k:\n  j0: " + frame + "  j1: " + frame, "k.yaml",
                                       measure::TableAngles::kRollPitchYaw, faults));
}

}  // namespace plumbline::factory_table_test
