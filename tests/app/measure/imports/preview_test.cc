#include "app/measure/imports/preview.h"

#include <catch2/catch.hpp>

namespace plumbline::preview_test {

using namespace plumbline::measure;

TEST_CASE("the preview shows layout, columns and rejected lines") {
  config::FaultList faults;
  const UnderstoodFile file =
      Understand("Job 7\nX [mm];Y [mm];Z [mm];Humidity [%]\n1,5;2,5;3,5;40\n1,5;;3,5;40\n", "f.csv",
                 FileRole::kMeasured, {}, "", {}, faults);
  const std::string text = PreviewText(file, RowsOf(file, {}));
  using Catch::Contains;
  CHECK_THAT(text, Contains("separator semicolon, decimal comma, column names in line 2"));
  CHECK_THAT(text, Contains("skipped: Job 7"));
  CHECK_THAT(text, Contains("X [mm]                 x_mm        mm"));
  CHECK_THAT(text, Contains("Humidity [%]           ignored"));
  CHECK_THAT(text, Contains("line 4: rejected: x, y and z are not all given"));
  CHECK_THAT(text, Contains("2 rows, 1 of them without a usable measurement"));
}

TEST_CASE("results of robot_calibration are listed, not taken for measurements") {
  const auto text = RobotCalibrationText(
      "shoulder_pan_joint: 0.0123\nhead_camera_x: -0.004\ndepth_info: depth.yaml\nurdf: c.urdf\n");
  REQUIRE(text);
  CHECK_THAT(*text, Catch::Contains("shoulder_pan_joint") && Catch::Contains("0.0123") &&
                        Catch::Contains("c.urdf") && Catch::Contains("--apply-rising"));
  CHECK_FALSE(RobotCalibrationText("a: b\n"));
  CHECK_FALSE(RobotCalibrationText("a: [1\n"));
}

}  // namespace plumbline::preview_test
