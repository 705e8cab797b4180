// Corrected kinematics written back into a URDF, checked from the XML that was written.
#include <catch2/catch.hpp>

#include "app/base/config/cell_reader.h"
#include "app/measure/urdf/cell_text.h"
#include "app/measure/urdf/corrected_urdf.h"
#include "app/measure/urdf/dh_table.h"
#include "app/measure/urdf/static_geometry.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "tests/app/measure/urdf/oracle.h"

namespace plumbline::urdf_export_test {
namespace {

constexpr const char* kEffects = R"(
[[effect]]
id = "joint_offset"
scope = ["q2", "q4"]
parameters = [ { name = "q2", value = 1.5e-3, unit = "rad" }, { name = "q4", value = -2e-3, unit = "rad" } ]

[[effect]]
id = "link_geometry"
scope = ["q1", "q3", "q5", "q6"]
parameters = [ { name = "a1", value = 0.8, unit = "mm" }, { name = "d3", value = -0.6, unit = "mm" },
  { name = "alpha5", value = 0.05, unit = "deg" }, { name = "a6", value = 0.4, unit = "mm" } ]
)";
constexpr const char* kGearRatio = R"(
[[effect]]
id = "gear_ratio"
scope = ["q3"]
parameters = [ { name = "q3", value = 1e-4, unit = "1" } ]
)";

struct Arm {
  measure::UrdfFile file;
  measure::JointChain chain;
  model::CellModel cell;
};

Arm ArmOf(const std::string& xml, const std::string& effects, measure::Rising rising) {
  config::FaultList faults;
  const auto file = measure::UrdfFromText(xml, "r.urdf", faults);
  REQUIRE(file);
  const auto chain = measure::ChainFromUrdf(*file, "r.urdf", "", "tip", rising, faults);
  REQUIRE(chain);
  const std::string text =
      measure::CellText(measure::RobotFromChain(*chain), *chain, "r.urdf") + effects;
  const auto cell = config::CellFromText(text, "cell.toml", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(cell);
  return {*file, *chain, *cell};
}

std::string Exported(const std::string& xml, const Arm& arm) {
  const auto corrected = measure::CorrectedOriginsOf(arm.file, arm.chain, arm.cell.robot,
                                                     measure::StaticGeometryOf(arm.cell).robot);
  INFO((corrected ? "" : corrected.error()));
  REQUIRE(corrected);
  CHECK(corrected->tip_left_m == 0);
  return measure::UrdfWithOrigins(xml, corrected->origins);
}

/// Largest distance between the corrected model's flange and the tip of a URDF text.
double LargestDistance(const Arm& arm, const std::string& xml) {
  const deflection::LoadedArm loaded(arm.cell);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2.5, 2.4);
  double largest_m = 0;
  for (int k = 0; k < 100; ++k) {
    std::map<std::string, double> by_name;
    model::JointVector q(6);
    for (int i = 0; i < 6; ++i) by_name["j" + std::to_string(i + 1)] = q[i] = uniform(random);
    deflection::LoadedState state;
    REQUIRE(loaded.AtCommanded(q, {}, {}, state));
    const Pose X = arm.cell.robot.X_WB * state.posture.X_BF();
    const Eigen::Isometry3d tip = test::UrdfTip(xml, "l0", "tip", by_name);
    largest_m =
        std::max({largest_m, (X.p - tip.translation()).norm(), (X.R - tip.linear()).norm()});
  }
  return largest_m;
}

}  // namespace

TEST_CASE("an exported URDF has the corrected model's kinematics") {
  std::mt19937 random(11);
  for (const test::Axes axes :
       {test::Axes::kGeneral, test::Axes::kParallel, test::Axes::kNearlyParallel}) {
    CAPTURE(static_cast<int>(axes));
    const std::string xml = test::RandomUrdf(random, 6, axes, false);
    const Arm arm = ArmOf(xml, kEffects, measure::Rising::kIgnored);
    CHECK(LargestDistance(arm, xml) > 5e-4);
    CHECK(LargestDistance(arm, Exported(xml, arm)) < 1e-9);
  }
}

TEST_CASE("what is not corrected stays, byte by byte") {
  std::mt19937 random(12);
  std::string xml = test::RandomUrdf(random, 6, test::Axes::kGeneral, true);
  xml.insert(xml.find("<link name=\"l1\""), "<!-- a <comment> & more -->\n\n  ");
  const Arm arm = ArmOf(xml, "", measure::Rising::kIgnored);
  CHECK(Exported(xml, arm) == xml);
  // Lines that differ after a correction of one joint: its own or the next origin.
  const std::string moved = Exported(xml, ArmOf(xml, R"(
[[effect]]
id = "joint_offset"
scope = ["q2"]
parameters = [ { name = "q2", value = 1e-3, unit = "rad" } ]
)",
                                                measure::Rising::kIgnored));
  std::istringstream before(xml), after(moved);
  std::string line, changed;
  int differences = 0;
  while (std::getline(before, line)) {
    REQUIRE(std::getline(after, changed));
    differences += line != changed ? 1 : 0;
  }
  CHECK(differences == 1);
}

TEST_CASE("effects that depend on the posture are left out and named") {
  std::mt19937 random(13);
  const std::string xml = test::RandomUrdf(random, 6, test::Axes::kGeneral, false);
  const Arm arm = ArmOf(xml, std::string(kEffects) + kGearRatio, measure::Rising::kIgnored);
  const measure::StaticGeometry geometry = measure::StaticGeometryOf(arm.cell);
  CHECK(geometry.included == std::vector<std::string>{"joint_offset", "link_geometry"});
  CHECK(geometry.left_out == std::vector<std::string>{"gear_ratio"});
}

TEST_CASE("a cell of another arm is refused") {
  std::mt19937 random(14);
  const std::string xml = test::RandomUrdf(random, 6, test::Axes::kGeneral, false);
  Arm arm = ArmOf(xml, "", measure::Rising::kIgnored);
  arm.cell.robot.joints[2].a_m += 1e-4;
  const auto refused =
      measure::CorrectedOriginsOf(arm.file, arm.chain, arm.cell.robot, arm.cell.robot);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Catch::Contains("describes another arm"));
}

TEST_CASE("an offset in calibration rising is added to the reading, and kept on export") {
  std::mt19937 random(15);
  std::string xml = test::RandomUrdf(random, 6, test::Axes::kGeneral, false);
  const auto j2 = xml.find("<axis", xml.find("joint name=\"j2\""));
  xml.insert(j2, "<calibration rising=\"0.02\"/>\n    ");
  const Arm arm = ArmOf(xml, kEffects, measure::Rising::kAddedToReading);
  const std::string written = Exported(xml, arm);
  const Arm again = ArmOf(written, "", measure::Rising::kAddedToReading);
  const deflection::LoadedArm corrected(arm.cell), read(again.cell);
  model::JointVector q(6);
  q << 0.3, -0.4, 1.1, 0.2, -0.9, 2;
  deflection::LoadedState a, b;
  REQUIRE((corrected.AtCommanded(q, {}, {}, a) && read.AtCommanded(q, {}, {}, b)));
  CHECK((arm.cell.robot.X_WB * a.posture.X_BF().p - again.cell.robot.X_WB * b.posture.X_BF().p)
            .norm() < 1e-9);
  // The oracle ignores <calibration>; it takes the offset as part of the position.
  const Eigen::Isometry3d tip = test::UrdfTip(
      xml, "l0", "tip",
      {{"j1", q[0]}, {"j2", q[1] + 0.02}, {"j3", q[2]}, {"j4", q[3]}, {"j5", q[4]}, {"j6", q[5]}});
  const Arm declared = ArmOf(xml, "", measure::Rising::kAddedToReading);
  REQUIRE(deflection::LoadedArm(declared.cell).AtCommanded(q, {}, {}, a));
  CHECK((declared.cell.robot.X_WB * a.posture.X_BF().p - tip.translation()).norm() < 1e-9);
}

}  // namespace plumbline::urdf_export_test
