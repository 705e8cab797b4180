// Posture check: points not reached as they were taught, and angles written in radians.
#include "app/base/config/posture_check.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <map>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/base/config/wrong_line.h"

namespace plumbline::posture_check_test {

using namespace plumbline::config;

namespace {

constexpr double kDegree = kRadPerDeg;
const std::vector<double> kTaught_deg = {20, -100, 110, -60, -80, 30};

std::string ListText(const std::vector<double>& values, double factor = 1) {
  std::string text;
  for (const double value : values) {
    text += fmt::format("{}{:.6f}", text.empty() ? "" : ", ", factor * value);
  }
  return "[" + text + "]";
}

std::string Ur10() {
  const Result<std::string> text = files::ReadTextFile("config/cells/ur10.toml");
  REQUIRE(text);
  return text.value();
}

/// `text` with the line of `key` replaced.
std::string With(std::string text, const std::string& key, const std::string& value) {
  const auto at = text.find("\n" + key + " = ");
  REQUIRE(at != std::string::npos);
  return text.replace(at + 1, text.find('\n', at + 1) - at - 1, key + " = " + value);
}

/// Pose of the UR10's flange at the taught joints, relative to a frame.
struct Taught {
  std::vector<double> xyz_mm, rpy_deg;

  explicit Taught(const Pose& X_WO = Pose(), const Pose& X_WB = Pose()) {
    FaultList faults;
    const auto cell = CellFromText(Ur10(), "ur10.toml", faults);
    REQUIRE(cell);
    model::JointVector q(6);
    for (int i = 0; i < 6; ++i) q[i] = kDegree * kTaught_deg[static_cast<std::size_t>(i)];
    kinematics::Posture posture;
    kinematics::Chain(cell->robot).Evaluate(q, posture);
    const Pose X_OP = X_WO.Inverse() * X_WB * posture.X_BF();
    const Vec3 rpy = AnglesFromRotation(X_OP.R, OrientationConvention::kRollPitchYaw);
    for (int k = 0; k < 3; ++k) {
      xyz_mm.push_back(1e3 * X_OP.p[k]);
      rpy_deg.push_back(rpy[k] / kDegree);
    }
  }
};

std::string Config(const Taught& point, const std::string& rpy, const std::string& near) {
  return "cell = \"ur10.toml\"\n[robot]\nprofile = \"generic.toml\"\nhost = \"10.0.0.2\"\n"
         "[payload]\nsource = \"fixed\"\nmass_kg = 2.0\n[[frame]]\nname = \"table\"\n"
         "xyz_mm = [100.0, 50.0, -20.0]\nrpy_deg = [0.0, 0.0, 0.0]\n"
         "[[point]]\nid = 3\nframe = \"measurement\"\nxyz_mm = " +
         ListText(point.xyz_mm) + "\nrpy_deg = " + rpy +
         (near.empty() ? "" : "\nnear_deg = " + near) + "\n";
}

/// The warnings of a configuration without faults.
std::vector<std::string> Warnings(const std::string& config, const std::string& cell = Ur10(),
                                  std::size_t postures = kAllPostures) {
  const FileSource files = [&](const std::string& path) -> Result<std::string> {
    if (path == "ur10.toml") return cell;
    if (path == "generic.toml") return files::ReadTextFile("config/profiles/generic.toml");
    return Error{"No such file or directory"};
  };
  FaultList faults;
  const auto read =
      DaemonConfigFromText(config, "plumbline.toml", files, "/nonexistent", faults, postures);
  CAPTURE(FaultsText(faults));
  CHECK(read);
  return Texts(faults, Fault::Severity::kWarning);
}

TEST_CASE("A point that is reached in the posture of near_deg has no warning") {
  const Taught point;
  CHECK(Warnings(Config(point, ListText(point.rpy_deg), ListText(kTaught_deg))).empty());
  std::vector<double> nearby = kTaught_deg;
  for (double& joint : nearby) joint += 12;  // a worn reading, a point that was moved
  CHECK(Warnings(Config(point, ListText(point.rpy_deg), ListText(nearby))).empty());
}

TEST_CASE("An axis 90 degrees from near_deg is reported with both values") {
  const Taught point;
  std::vector<double> wrong = kTaught_deg;
  wrong[3] += 90;
  const auto warnings = Warnings(Config(point, ListText(point.rpy_deg), ListText(wrong)));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("plumbline.toml:17 point[1].near_deg: warning: ") &&
                              Catch::Contains("q4 is 30.0 in near_deg, but -60.0 deg") &&
                              Catch::Contains("[20.0, -100.0, 110.0, -60.0, -80.0, 30.0]") &&
                              Catch::Contains("Read the joint values from the pendant"));
}

TEST_CASE("Points whose posture is not checked are counted in a warning") {
  const Taught point;
  std::vector<double> wrong = kTaught_deg;
  wrong[3] += 90;
  std::string config = Config(point, ListText(point.rpy_deg), ListText(wrong));
  for (const int id : {4, 5}) {
    config += fmt::format(
        "[[point]]\nid = {}\nframe = \"measurement\"\nxyz_mm = {}\nrpy_deg = {}\nnear_deg = {}\n",
        id, ListText(point.xyz_mm), ListText(point.rpy_deg), ListText(wrong));
  }
  CHECK(Warnings(config).size() == 3);
  CHECK(Warnings(config, Ur10(), 3).size() == 3);
  CHECK(Warnings(config, Ur10(), 0).empty());
  const auto some = Warnings(config, Ur10(), 1);
  REQUIRE(some.size() == 2);
  const bool first = some[0].find("first 1 point") != std::string::npos;
  CHECK_THAT(some[first ? 0 : 1], Catch::Contains("`plumbline check` for the other 2"));
  CHECK_THAT(some[first ? 1 : 0], Catch::Contains("point[1].near_deg: warning: "));
}

TEST_CASE("Angles in radians are recognised by the point that is then reached") {
  const Taught point;
  const std::string in_rad = ListText(kTaught_deg, kDegree), in_deg = ListText(kTaught_deg);
  const std::string rpy_rad = ListText(point.rpy_deg, kDegree), rpy_deg = ListText(point.rpy_deg);
  SECTION("near_deg") {
    const auto warnings = Warnings(Config(point, rpy_deg, in_rad));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(
        warnings[0],
        Catch::Contains("point[1].near_deg: warning: ") &&
            Catch::Contains(
                "is probably in radians: read as radians, the arm reaches point 3 in the posture "
                "of near_deg; read as degrees, the nearest posture that reaches it is") &&
            Catch::Contains("Write [20.0, -100.0, 110.0, -60.0, -80.0, 30.0]"));
  }
  SECTION("rpy_deg of a point") {
    const auto warnings = Warnings(Config(point, rpy_rad, in_deg));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(
        warnings[0],
        Catch::Contains("point[1].rpy_deg: warning: ") &&
            Catch::Contains("is probably in radians: read as radians, the arm reaches point 3"));
  }
  SECTION("both") {
    const auto warnings = Warnings(Config(point, rpy_rad, in_rad));
    REQUIRE(warnings.size() == 2);
    CHECK_THAT(warnings[0], Catch::Contains("point[1].rpy_deg: warning: ") &&
                                Catch::Contains("is probably in radians"));
    CHECK_THAT(warnings[1], Catch::Contains("point[1].near_deg: warning: ") &&
                                Catch::Contains("is probably in radians"));
  }
  SECTION("rpy_deg of a frame") {
    const std::vector<double> turn_deg = {10, -20, 75};
    const Pose X_WO = {RotationFromRollPitchYaw(kDegree * Vec3(10, -20, 75)),
                       Vec3(0.1, 0.05, -0.02)};
    const Taught in_frame(X_WO);
    std::string config = Config(in_frame, ListText(in_frame.rpy_deg), in_deg);
    config = With(config, "frame", "\"table\"");
    CHECK(Warnings(With(config, "rpy_deg", ListText(turn_deg))).empty());
    const auto warnings = Warnings(With(config, "rpy_deg", ListText(turn_deg, kDegree)));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::Contains("plumbline.toml:11 frame[1].rpy_deg: warning: ") &&
                                Catch::Contains("is probably in radians") &&
                                Catch::Contains("Write [10, -20, 75]"));
  }
  SECTION("base_rpy_deg of the cell") {
    const Pose X_WB = {RotationFromRollPitchYaw(kDegree * Vec3(0, 0, 40)), Vec3::Zero()};
    const Taught at_base(Pose(), X_WB);
    const std::string config = Config(at_base, ListText(at_base.rpy_deg), in_deg);
    CHECK(Warnings(config, With(Ur10(), "base_rpy_deg", "[0, 0, 40]")).empty());
    const auto warnings = Warnings(config, With(Ur10(), "base_rpy_deg", "[0, 0, 0.698132]"));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::Contains("ur10.toml:20 robot.base_rpy_deg: warning: ") &&
                                Catch::Contains("is probably in radians") &&
                                Catch::Contains("Write [0, 0, 40]"));
  }
}

TEST_CASE("Small angles confirmed by the point are degrees") {
  const auto config = [](double turn_deg, const std::vector<double>& near_deg) {
    const Pose X_WO = {RotationFromRollPitchYaw(kDegree * Vec3(0, 0, turn_deg)),
                       Vec3(0.1, 0.05, -0.02)};
    const Taught in_frame(X_WO);
    const std::string text = Config(in_frame, ListText(in_frame.rpy_deg), ListText(near_deg));
    return With(With(text, "frame", "\"table\""), "rpy_deg", fmt::format("[0, 0, {}]", turn_deg));
  };
  CHECK(Warnings(config(3.14, kTaught_deg)).empty());
  // 5 rad would be -73.5 degrees: near to a near_deg that is wrong by -60, but not what was meant.
  std::vector<double> wrong = kTaught_deg;
  wrong[0] -= 60;
  const auto warnings = Warnings(config(5, wrong));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0],
             Catch::Contains("point[1].near_deg: warning: ") &&
                 Catch::Contains("q1 is -40.0 in near_deg, but 20.0 deg in the nearest posture"));
}

TEST_CASE("A point without near_deg: angles are doubted only if nothing else decides") {
  const Taught point;
  const auto missing = [](const std::vector<std::string>& warnings) {
    return warnings.size() == 1 && warnings[0].find("near_deg: warning: missing") < 200;
  };
  CHECK(missing(Warnings(Config(point, ListText(point.rpy_deg), ""))));
  const auto doubted = Warnings(Config(point, "[3.1416, 0, 0]", ""));
  REQUIRE(doubted.size() == 2);
  CHECK_THAT(
      doubted[1],
      Catch::Contains(
          "rpy_deg: warning: [3.1416, 0, 0] looks like radians; in degrees write [180, 0, 0]"));
}

TEST_CASE("An unreachable point is a warning with the payload and a remedy") {
  Taught point;
  point.xyz_mm = {1000.0, 900.0, 600.0};
  const auto warnings = Warnings(Config(point, ListText(point.rpy_deg), ListText(kTaught_deg)));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0],
             Catch::Contains("point[1].xyz_mm: warning: ") &&
                 Catch::Contains("has no corrected point with 2 kg (out of reach): no posture "
                                 "reaches it. Check the pose, its frame"));
}

TEST_CASE("near_deg in radians that violates a limit as degrees is a fault with a hint") {
  const FileSource files = [](const std::string& path) -> Result<std::string> {
    if (path == "kr210.toml") return files::ReadTextFile("config/cells/kr210.toml");
    return files::ReadTextFile("config/profiles/generic.toml");
  };
  FaultList faults;
  DaemonConfigFromText(
      "cell = \"kr210.toml\"\n[robot]\nprofile = \"generic.toml\"\nhost = \"10.0.0.2\"\n"
      "[[point]]\nid = 1\nxyz_mm = [2000, 0, 1500]\nnear_deg = [0, -1.5708, 1.5708, 0, 0.3, 0]\n",
      "plumbline.toml", files, "/nonexistent", faults);
  CHECK(faults.HasFaults());
  CHECK_THAT(FaultsText(faults),
             Catch::Contains("has joint 2 outside its limits -140..-5") &&
                 Catch::Contains("looks like radians; in degrees write [0, -90, 90"));
}

}  // namespace
}  // namespace plumbline::posture_check_test
