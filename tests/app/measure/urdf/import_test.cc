// A cell imported from a URDF against forward kinematics computed from the XML.
#include <catch2/catch.hpp>

#include "firmware-like/loads/gravity.h"
#include "tests/app/measure/urdf/imported.h"

namespace plumbline::urdf_import_test {
using test::CheckAgainstXml;
using test::Import;
using test::Imported;

TEST_CASE("an imported arm has the URDF's forward kinematics, whatever its axes") {
  std::mt19937 random(5);
  for (const test::Axes axes :
       {test::Axes::kGeneral, test::Axes::kParallel, test::Axes::kNearlyParallel,
        test::Axes::kCoaxial, test::Axes::kIntersecting}) {
    for (const bool slides : {false, true}) {
      for (int seed = 0; seed < 3; ++seed) {
        CAPTURE(static_cast<int>(axes), slides, seed);
        const std::string xml = test::RandomUrdf(random, 6, axes, slides);
        CheckAgainstXml(xml, Import(xml), 30, random);
      }
    }
  }
  const std::string xml = test::RandomUrdf(random, 7, test::Axes::kGeneral, true);
  CheckAgainstXml(xml, Import(xml), 1000, random);
}

TEST_CASE("nearly parallel axes give short rows with beta") {
  std::mt19937 random(6);
  const Imported imported = Import(test::RandomUrdf(random, 6, test::Axes::kNearlyParallel, false));
  for (std::size_t i = 0; i < 5; ++i) {
    const model::Joint& row = imported.cell.robot.joints[i];
    CHECK(std::abs(row.a_m) < 2);
    CHECK(std::abs(row.d_m) < 2);
  }
}

TEST_CASE("masses, centres of mass and limits come along") {
  std::mt19937 random(7);
  const std::string xml = test::RandomUrdf(random, 6, test::Axes::kGeneral, false);
  const Imported imported = Import(xml);
  CHECK(imported.cell.robot.joints[0].link_mass_kg == Approx(2.5));
  CHECK(imported.cell.robot.joints[1].link_mass_kg == Approx(5));  // with the bracket
  CHECK(imported.cell.robot.joints[5].link_mass_kg == Approx(5));  // with the tip
  CHECK(imported.cell.robot.joints[2].min == Approx(-2.5));
  CHECK(imported.cell.robot.joints[2].max == Approx(2.4));
  // The centre of mass of link 1 in the base, from the XML and from the table.
  pugi::xml_document document;
  document.load_string(xml.c_str());
  const pugi::xml_node link = document.child("robot").find_child_by_attribute("link", "name", "l1");
  const Eigen::Vector3d com = test::Triple(link.child("inertial").child("origin"), "xyz", {});
  const Eigen::Vector3d expected = test::UrdfTip(xml, "l0", "l1", {{"j1", 0.7}}) * com;
  kinematics::Posture posture;
  model::JointVector q = model::JointVector::Zero(6);
  q[0] = 0.7;
  kinematics::Chain(imported.cell.robot).Evaluate(q, posture);
  const Vec3 found =
      imported.cell.robot.X_WB * (posture.X_BL[0] * *imported.cell.robot.joints[0].link_com_m);
  CHECK((found - expected).norm() < 1e-9);
}

}  // namespace plumbline::urdf_import_test
