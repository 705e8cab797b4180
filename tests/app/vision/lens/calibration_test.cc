// Calibrated lenses against ground truth, and captures that must be refused.
#include "app/vision/lens/calibration.h"

#include <catch2/catch.hpp>

#include "app/vision/lens/board_detection.h"
#include "app/vision/lens/lens_json.h"
#include "drivers/camera/image_folder.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::calibration_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};
constexpr double kNoise_px = 0.03;

LensCalibration Calibrated(const Capture& capture, std::uint64_t seed,
                           double noise_px = kNoise_px) {
  const target::Board board;
  return CalibrateLens(board, NoisyViews(DrawViews(capture, board, seed), board, noise_px, seed),
                       kSize);
}

std::string AllReasons(const LensCalibration& calibration) {
  std::string all;
  for (const std::string& reason : calibration.reasons) all += reason + "\n";
  return all;
}

}  // namespace

TEST_CASE("the lens error is within its stated uncertainty, from wide to long lenses") {
  for (const double f : {1000.0, 1700.0, 5000.0, 12000.0}) {
    Capture capture;
    capture.f = f;
    double z2 = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const LensCalibration c = Calibrated(capture, seed);
      const lens::Lens truth = test::LensOfCamera(renderer::ZoomLens(f));
      INFO("f " << f << ", seed " << seed << "\n" << AllReasons(c));
      REQUIRE(c.lens.fx > 0);
      const double z = (c.lens.fx - truth.fx) / std::sqrt(c.covariance(kFx, kFx));
      CHECK(std::abs(z) < 4.5);
      z2 += z * z / 5;
      CHECK(LargestDifference(truth, c.lens, kSize) < 5 * c.uncertainty.max_px);
      CHECK(c.sigma_px == Approx(kNoise_px).epsilon(0.1));
      CHECK(c.frames_used.size() == 20);
    }
    CHECK(z2 < 3.5);  // chi^2 of 5: exceeded once in 300
    CHECK(z2 > 0.05);
  }
}

TEST_CASE("a bowed board does not bias the lens") {
  Capture capture;
  capture.bow = 0.05;  // up to about half a millimetre at the board's ends
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const LensCalibration c = Calibrated(capture, seed);
    const auto drawn = DrawViews(capture, target::Board{}, seed)[0].sheet;
    INFO(AllReasons(c));
    CHECK(c.accepted);
    CHECK(LargestDifference(test::LensOfCamera(renderer::ZoomLens(capture.f)), c.lens, kSize) <
          std::max(5 * c.uncertainty.max_px, 0.1));
    CHECK((c.board_bow_m > 2e-5) ==
          (std::abs(drawn.bow_x) + std::abs(drawn.bow_y) + std::abs(drawn.bow_xy) > 0.004));
  }
}

TEST_CASE("unsuitable captures are refused with advice") {
  Capture capture;
  std::string expected;
  SECTION("a lens that creeps") {
    capture.creep = 0.005;
    expected = "the lens moved while the frames were taken";
  }
  SECTION("a lens that jumps halfway through") {
    capture.step = 0.004;
    expected = "the lens moved";
  }
  SECTION("twenty identical views") {
    capture.kind = Capture::Kind::kSame;
    expected = "the views are too similar; tilt the board";
  }
  SECTION("a one-second burst through a long lens") {
    capture.kind = Capture::Kind::kBurst;
    capture.f = 12000;
    expected = "the projection is uncertain by";
  }
  SECTION("too few views") {
    capture.views = 4;
    expected = "the board was found in 4 usable frames; at least 6 are needed";
  }
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const LensCalibration c = Calibrated(capture, seed);
    INFO("seed " << seed);
    CHECK_FALSE(c.accepted);
    CHECK(AllReasons(c).find(expected) != std::string::npos);
  }
}

TEST_CASE("without any views, the calibration is refused") {
  const LensCalibration c = CalibrateLens(target::Board{}, {}, {});
  CHECK_FALSE(c.accepted);
  CHECK(c.reasons.size() == 1);
  CHECK(LensJson(c).find("\"fx\": null") != std::string::npos);
}

TEST_CASE("blurred and inconsistent views are excluded and named") {
  const target::Board board;
  auto views = NoisyViews(DrawViews({}, board, 3), board, kNoise_px, 3);
  views[4].blur_px = 6;
  std::mt19937_64 random(1);
  std::normal_distribution<double> N(0, 3);
  for (lens::Vec2& corner : views[9].corners_px) corner += lens::Vec2(N(random), N(random));
  for (std::size_t k = 0; k < 12; ++k) views[12].corners_px[k] += lens::Vec2(8, -5);  // a glare
  const LensCalibration c = CalibrateLens(board, views, kSize);
  INFO(AllReasons(c));
  CHECK(c.accepted);
  REQUIRE(c.frames_refused.size() == 2);
  CHECK(c.frames_refused[0].name == "view 4");
  CHECK(c.frames_refused[0].reason.find("blurred") == 0);
  CHECK(c.frames_refused[1].name == "view 9");
  CHECK(LargestDifference(test::LensOfCamera(renderer::ZoomLens(1700)), c.lens, kSize) <
        5 * c.uncertainty.max_px);
}

TEST_CASE("errors common to all views widen the stated uncertainty") {
  const target::Board board;
  auto views = NoisyViews(DrawViews({}, board, 3), board, kNoise_px, 3);
  const LensCalibration even = CalibrateLens(board, views, kSize);
  std::mt19937_64 random(1);
  std::normal_distribution<double> N(0, 0.015);
  std::vector<lens::Vec2> print;
  for (int k = 0; k < board.corners(); ++k) print.emplace_back(N(random), N(random));
  for (BoardView& view : views) {
    for (int k = 0; k < board.corners(); ++k) view.corners_px[k] += print[k];
  }
  const LensCalibration uneven = CalibrateLens(board, views, kSize);
  CHECK(uneven.uncertainty.max_px > 1.5 * even.uncertainty.max_px);
}

TEST_CASE("the JSON file contains the result and is read back") {
  const LensCalibration c = Calibrated({}, 2);
  const auto file = LensFromJson(LensJson(c));
  REQUIRE(file);
  CHECK(file->accepted == c.accepted);
  CHECK(file->size == kSize);
  CHECK(file->lens.fx == c.lens.fx);
  CHECK(file->lens.k3 == c.lens.k3);
  CHECK(file->covariance.isApprox(c.covariance, 1e-12));
  for (const char* broken :
       {"", "[]", "{}", R"({"image_size": [1920, 1080], "fx": 0, "fy": 1, "cx": 1, "cy": 1})",
        R"({"image_size": [0, 1080], "fx": 1})",
        R"({"image_size": [9, 9], "fx": 1, "fy": 1, "cx": 1, "cy": 1, "distortion": [1, 2]})",
        R"({"image_size": [9, 9], "fx": "1", "fy": 1, "cx": 1, "cy": 1,
            "distortion": [0, 0, 0, 0, 0]})"}) {
    INFO(broken);
    CHECK_FALSE(LensFromJson(broken));
  }
}

}  // namespace plumbline::calibration_test
