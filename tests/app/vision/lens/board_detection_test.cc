// Chessboard detection in rendered images against ground truth, and in images without a board.
#include "app/vision/lens/board_detection.h"

#include <catch2/catch.hpp>
#include <numbers>
#include <numeric>

#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::board_detection_test {

using namespace plumbline::vision;

namespace {

/// RMS error per coordinate; the board may be detected rotated by half a turn.
double RmsOf(const BoardView& found, const std::vector<lens::Vec2>& truth) {
  double least = 1e9;
  for (const bool turned : {false, true}) {
    double sum = 0;
    int count = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (!found.seen[k]) continue;
      const lens::Vec2& t = truth[turned ? truth.size() - 1 - k : k];
      sum += (found.corners_px[k] - t).squaredNorm();
      count += 2;
    }
    least = std::min(least, std::sqrt(sum / count));
  }
  return least;
}

renderer::Conditions Light(double contrast, double noise, double blur = 0.8) {
  renderer::Conditions light;
  light.black = 90 - contrast / 2;
  light.white = 90 + contrast / 2;
  light.noise = noise;
  light.blur_px = blur;
  return light;
}

}  // namespace

TEST_CASE("corners are found to a few hundredths of a pixel, at every zoom") {
  const target::Board board;
  for (const double f : {1000.0, 1700.0, 12000.0}) {
    Capture capture;
    capture.f = f;
    capture.views = 3;
    const auto views = DrawViews(capture, board, 11);
    for (std::size_t k = 0; k < views.size(); ++k) {
      const auto image =
          renderer::Render(views[k].camera, {views[k].sheet}, Light(180, 3), 100 + k);
      const auto found = DetectBoard(test::ViewOf(image), board);
      INFO("f " << f << ", view " << k);
      REQUIRE(found);
      CHECK(std::count(found->seen.begin(), found->seen.end(), true) >= board.corners() - 4);
      CHECK(RmsOf(*found, TrueCorners(views[k], board)) < 0.08);
      CHECK(found->blur_px == Approx(0.9).margin(0.3));
    }
  }
}

TEST_CASE("the colours show which way round a board of 9 x 6 is held") {
  const target::Board board{9, 6, 0.020};
  Capture capture;
  capture.views = 3;
  for (DrawnView& view : DrawViews(capture, board, 12)) {
    for (const bool turned : {false, true}) {
      if (turned) {
        const Eigen::Translation3d centre(board.Centre().x(), board.Centre().y(), 0);
        const Eigen::AngleAxisd half(std::numbers::pi, Eigen::Vector3d::UnitZ());
        view.sheet.X_CK = view.sheet.X_CK * centre * half * centre.inverse();
      }
      const auto image = renderer::Render(view.camera, {view.sheet}, Light(180, 3), 100);
      const auto found = DetectBoard(test::ViewOf(image), board);
      REQUIRE(found);
      CHECK((found->corners_px[0] - TrueCorners(view, board)[0]).norm() < 1);
    }
  }
}

TEST_CASE("poor light, shade, ripple and blur") {
  const target::Board board;
  Capture capture;
  capture.views = 1;
  const DrawnView view = DrawViews(capture, board, 5)[0];
  struct Case {
    const char* name;
    renderer::Conditions light;
    double rms_px;
  };
  renderer::Conditions shaded = Light(120, 3), ripple = Light(120, 3);
  shaded.shade_x = 1.2;
  shaded.shade_y = -0.5;
  ripple.flicker = 0.25;
  for (const Case& one :
       {Case{"contrast of 20 levels", Light(20, 3), 0.25},
        Case{"light from one side", shaded, 0.05}, Case{"rolling light", ripple, 0.12},
        Case{"blur of 3 px", Light(150, 3, 3), 0.1}}) {
    INFO(one.name);
    const auto image = renderer::Render(view.camera, {view.sheet}, one.light, 7);
    const auto found = DetectBoard(test::ViewOf(image), board);
    REQUIRE(found);
    CHECK(RmsOf(*found, TrueCorners(view, board)) < one.rms_px);
  }
}

TEST_CASE("a frame without the board: the error says what it shows") {
  const target::Board board;
  Capture capture;
  capture.views = 1;
  DrawnView view = DrawViews(capture, board, 5)[0];
  const renderer::Conditions light = Light(150, 3);
  SECTION("no board at all") {
    renderer::Conditions cluttered = light;
    cluttered.clutter = 60;
    for (int seed = 0; seed < 5; ++seed) {
      const auto image = renderer::Render(view.camera, {}, cluttered, seed);
      const auto found = DetectBoard(test::ViewOf(image), board);
      REQUIRE_FALSE(found);
      CHECK(found.error() == "no chessboard");
    }
  }
  SECTION("black, white and saturated frames") {
    for (const int grey : {0, 255}) {
      const std::vector<std::uint8_t> image(1920 * 1080, static_cast<std::uint8_t>(grey));
      CHECK_FALSE(DetectBoard({image.data(), 1920, 1080, 1920}, board));
    }
  }
  SECTION("another board") {
    const auto image = renderer::Render(view.camera, {view.sheet}, light, 7);
    const auto found = DetectBoard(test::ViewOf(image), target::Board{16, 10, 0.01});
    REQUIRE_FALSE(found);
    CHECK(found.error() == "a board of 17 x 11 inner corners instead of 16 x 10: check --board");
  }
  SECTION("half of the board") {
    view.sheet.half_width_m /= 2;
    const auto image = renderer::Render(view.camera, {view.sheet}, light, 7);
    const auto found = DetectBoard(test::ViewOf(image), board);
    REQUIRE_FALSE(found);
    CHECK(found.error().find("only a part of the board") == 0);
  }
  SECTION("a tiny image") {
    const std::vector<std::uint8_t> image(8 * 8, 7);
    CHECK_FALSE(DetectBoard({image.data(), 8, 8, 8}, board));
  }
}

TEST_CASE("noise and fine chessboards over the whole frame are processed in bounded time") {
  std::mt19937_64 random(1);
  std::vector<std::uint8_t> image(1920 * 1080);
  for (std::uint8_t& pixel : image) pixel = static_cast<std::uint8_t>(random());
  CHECK_FALSE(DetectBoard({image.data(), 1920, 1080, 1920}, target::Board{}));
  for (const int side : {3, 7, 16, 33}) {
    for (int k = 0; k < 1920 * 1080; ++k)
      image[k] = (k % 1920 / side + k / 1920 / side) % 2 == 0 ? 20 : 220;
    CHECK_FALSE(DetectBoard({image.data(), 1920, 1080, 1920}, target::Board{}));
  }
}

}  // namespace plumbline::board_detection_test
