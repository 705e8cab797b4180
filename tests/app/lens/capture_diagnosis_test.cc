// Captures that go wrong are refused with their true cause; good ones are accepted.
#include "app/lens/capture_diagnosis.h"

#include <catch2/catch.hpp>

#include "app/lens/calibration.h"
#include "tests/app/lens/rendered_views.h"
#include "tests/lens_captures/capture_maker.h"

namespace plumbline::capture_diagnosis_test {

using namespace plumbline::lens;
using namespace plumbline::lens_captures;

namespace {

LensCalibration CalibrationOf(const std::string& name, std::uint64_t seed) {
  for (const Kind& kind : AllKinds()) {
    if (kind.name != name) continue;
    Random random(seed);
    Conditions conditions = GoodConditions(random);
    kind.prepare(conditions, random);
    const SimulatedCapture capture = Simulate(conditions, random);
    return CalibrateLens(conditions.board, capture.views, {conditions.width, conditions.height});
  }
  FAIL("no kind " << name);
  return {};
}

std::string ReasonsOf(const LensCalibration& calibration) {
  std::string all;
  for (const std::string& reason : calibration.reasons) all += reason + "\n";
  return all;
}

}  // namespace

TEST_CASE("a zoom that jumps before the last frames is refused, and the frame is named") {
  for (const char* name : {"zoom jumps before the last 2", "zoom jumps before the last 3"}) {
    const LensCalibration c = CalibrationOf(name, 3);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK_FALSE(c.accepted);
    CHECK_FALSE(c.further_views_help);
    CHECK(ReasonsOf(c).find("the focal length changed by") != std::string::npos);
    CHECK(ReasonsOf(c).find("between view") != std::string::npos);
  }
}

TEST_CASE("a board that moves under a rolling shutter is not a moved lens") {
  for (const char* name : {"rolling shutter, speeds differ", "rolling shutter, only some frames"}) {
    const LensCalibration c = CalibrationOf(name, 5);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK_FALSE(c.accepted);
    CHECK(ReasonsOf(c).find("rolling shutter") != std::string::npos);
    CHECK(ReasonsOf(c).find("lens moved") == std::string::npos);
  }
}

TEST_CASE("a board that is not as declared is named as such") {
  for (const auto& [name, words] : {std::pair("print stretched along its rows", "stretched by"),
                                    {"board S-shaped", "not flat"},
                                    {"paper held in the hand", "the board bends"}}) {
    const LensCalibration c = CalibrationOf(name, 8);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK_FALSE(c.accepted);
    CHECK(ReasonsOf(c).find(words) != std::string::npos);
    CHECK(ReasonsOf(c).find("lens moved") == std::string::npos);
  }
}

TEST_CASE("a fisheye is distinguished from a lens that moved") {
  const LensCalibration c = CalibrationOf("fisheye, 130 degrees", 2);
  INFO(ReasonsOf(c));
  CHECK_FALSE(c.accepted);
  CHECK(ReasonsOf(c).find("five") != std::string::npos);
  CHECK(ReasonsOf(c).find("lens moved") == std::string::npos);
}

TEST_CASE("repeated frames count once") {
  const LensCalibration c = CalibrationOf("every frame delivered three times", 4);
  INFO(ReasonsOf(c));
  CHECK(c.frames_used.size() <= 11);
  CHECK(c.frames_refused.size() >= 13);
  CHECK(c.frames_refused[0].reason.find("repeats an earlier frame") == 0);
}

TEST_CASE("frames that cannot be used at the end leave the lens unknown") {
  const Board board;
  const image::ImageSize size{1920, 1080};
  auto views = NoisyViews(DrawViews({}, board, 3), board, 0.03, 3);
  REQUIRE(CalibrateLens(board, views, size).accepted);
  views.back().blur_px = 8;
  const LensCalibration c = CalibrateLens(board, views, size);
  INFO(ReasonsOf(c));
  CHECK_FALSE(c.accepted);
  CHECK(c.further_views_help);
  CHECK(ReasonsOf(c).find("the last frame") != std::string::npos);
}

}  // namespace plumbline::capture_diagnosis_test
