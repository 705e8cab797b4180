// Right angles written with a few decimals: converted as written, with what it may cost.
#include "app/measure/urdf/right_angles.h"

#include "tests/app/measure/urdf/imported.h"

namespace plumbline::urdf_right_angles_test {
namespace {

std::string Arm(const std::string& rpy1, const std::string& rpy2) {
  return "<robot name=\"r\"><link name=\"l0\"/>\n<link name=\"l1\"/>\n<link name=\"tip\"/>\n"
         "<joint name=\"j1\" type=\"revolute\"><parent link=\"l0\"/><child link=\"l1\"/>"
         "<origin xyz=\"0 0 0.2\" rpy=\"" +
         rpy1 +
         "\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" upper=\"3\"/></joint>\n"
         "<joint name=\"f\" type=\"fixed\"><parent link=\"l1\"/><child link=\"tip\"/>"
         "<origin xyz=\"0 0 1\" rpy=\"" +
         rpy2 + "\"/></joint></robot>";
}

std::string NoteOf(const std::string& xml) {
  config::FaultList faults;
  const auto file = measure::UrdfFromText(xml, "r.urdf", faults);
  const auto chain =
      measure::ChainFromUrdf(*file, "r.urdf", "", "", measure::Rising::kIgnored, faults);
  REQUIRE(chain);
  const auto note = measure::RoundedAnglesNote(*file, "r.urdf", *chain, measure::Rising::kIgnored);
  return note ? config::FaultText(*note) : "";
}

}  // namespace

TEST_CASE("a right angle with two to many decimals is recognised, rounded or cut off") {
  for (const double angle : {1.57, 1.571, 1.5708, 1.5707, 1.570796, -1.57079632679, 3.14, 3.1416,
                             3.1415, -3.14159, 4.7124, 6.2832, 1.570796326794}) {
    CAPTURE(angle);
    CHECK(measure::RoundedRightAngle(angle));
  }
  for (const double angle :
       {0.0, 1e-5, 1.6, 3.1, 1.5, 0.7854, 1.5718, 1.5698, 1.5707963267948966, 3.141592653589793,
        3.1428, 1.5708021, 1.58, -1.58, 3.15, 4.72, 3.1417}) {
    CAPTURE(angle);
    CHECK_FALSE(measure::RoundedRightAngle(angle));
  }
}

TEST_CASE("how far the flange is from that of exact right angles is said") {
  // 3.1416 - pi = 7.3464e-6 rad at a lever of 1 m.
  CHECK_THAT(NoteOf(Arm("3.1416 0 0", "0 0 0")),
             Catch::Contains("r.urdf:4 joint j1.origin.rpy: warning: 3.1416 looks like a rounded "
                             "right angle. Converted as written") &&
                 Catch::Contains("up to 0.0073 mm and 0.00042 deg away: write 3.1415926535897931"));
  CHECK_THAT(NoteOf(Arm("3.1416 0 -1.5708", "0 1.57 0")),
             Catch::Contains("r.urdf:5 joint f.origin.rpy: warning: 1.57 looks like a rounded "
                             "right angle, one of 3 on the way to tip"));
  CHECK(NoteOf(Arm("1.57079632679 0 0", "0 0 0")).empty());  // 5e-9 mm
  CHECK(NoteOf(Arm("1.4321 0 0", "0.7854 0 0")).empty());
}

}  // namespace plumbline::urdf_right_angles_test
