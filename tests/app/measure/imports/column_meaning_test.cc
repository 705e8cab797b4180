#include "app/measure/imports/column_meaning.h"

#include <catch2/catch.hpp>

namespace plumbline::column_meaning_test {

using namespace plumbline::measure;

namespace {

std::vector<std::string> TargetsOf(const std::vector<std::string>& names) {
  std::vector<std::string> targets;
  for (const ColumnMeaning& meaning : MeaningsOf(names, {})) targets.push_back(meaning.target);
  return targets;
}

}  // namespace

TEST_CASE("columns of a Leica export") {
  const std::vector<std::string> names = {"X  [mm]",
                                          "Y  [mm]",
                                          "U(95)  [\xC2\xB5m]",
                                          "U(95) X  [mm]",
                                          "Tilt  [deg]",
                                          "Q0",
                                          "Q1",
                                          "Q2",
                                          "Q3",
                                          "Target",
                                          "Temperature  [\xC2\xB0"
                                          "C]",
                                          "Time Stamp"};
  CHECK(TargetsOf(names) == std::vector<std::string>{"x_mm", "y_mm", "u95_mm", "u95_x_mm", "", "qw",
                                                     "qx", "qy", "qz", "name", "temp_C", "t_s"});
  CHECK(MeaningsOf(names, {})[2].unit == "\xC2\xB5m");
}

TEST_CASE("columns of CMM and robot exports") {
  CHECK(TargetsOf({"Element Name", "Number", "Deviation", "MX Coord.", "NX Coord."}) ==
        std::vector<std::string>{"name", "number", "", "x_mm", ""});
  CHECK(
      TargetsOf({"step_order", "x_t", "x_dif", "joint_1", "A2 (rad)", "q3_deg", "Joint 4 [mm]"}) ==
      std::vector<std::string>{"number", "x_mm", "", "q1_deg", "q2_deg", "q3_deg", "q4_mm"});
  CHECK(MeaningsOf({"A2 (rad)"}, {})[0].unit == "rad");
  CHECK(MeaningsOf({"x"}, {"[m]"})[0].unit == "m");
  CHECK(TargetsOf({"x", "x"}) == std::vector<std::string>{"x_mm", ""});
  CHECK(TargetsOf({"q1", "q2", "q3", "q4"})[3] == "q4_deg");
  CHECK(TargetsOf({"t", "t_s"}) == std::vector<std::string>{"", "t_s"});
  CHECK(TargetsOf({"joint_99", "j0"}) == std::vector<std::string>{"", ""});
  CHECK(TargetsOf({"J0", "J1", "J2"}) == std::vector<std::string>{"q1_deg", "q2_deg", "q3_deg"});
  CHECK(TargetsOf({"q0", "q1", "q2", "q3", "q4", "q5"}).back() == "q6_deg");
}

TEST_CASE("units") {
  CHECK(ScaleOf(ValueKind::kLength, "in")->factor == 25.4);
  CHECK(ScaleOf(ValueKind::kTemperature, "F")->offset == Approx(-17.7777778));
  CHECK_FALSE(ScaleOf(ValueKind::kLength, ""));
  CHECK_FALSE(ScaleOf(ValueKind::kAngle, "mm"));
  CHECK(ScaleOf(ValueKind::kMass, ""));
}

}  // namespace plumbline::column_meaning_test
