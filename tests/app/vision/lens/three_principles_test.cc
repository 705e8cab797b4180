// Errors of a lens that show where they belong, whatever causes them: fixed in the image, dependent
// on how the board was held, or in the shape of the pixels.
#include <catch2/catch.hpp>
#include <cmath>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "app/vision/lens/residual_parts.h"
#include "app/vision/lens/view_dependence.h"
#include "app/vision/lens/view_selection.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/lens_captures/capture_maker.h"

namespace plumbline::three_principles_test {

using namespace plumbline::vision;
using namespace plumbline::lens_captures;

namespace {

/// A camera of known size, so that the sizes below mean the same in every run.
Conditions Known(Random& random) {
  Conditions conditions = GoodConditions(random);
  conditions.width = 1280;
  conditions.height = 960;
  conditions.camera = {};
  conditions.camera.fx = conditions.camera.fy = 1400;
  conditions.camera.cx = 640;
  conditions.camera.cy = 470;
  conditions.camera.k[0] = -0.1;
  conditions.board = {11, 8, 0.03};
  conditions.views = 20;
  conditions.noise_px = 0.04;
  conditions.print_noise_m = 0;
  return conditions;
}

struct Fitted {
  SimulatedCapture capture;
  LensFit fit;
  ResidualParts parts;
  image::ImageSize size;
};

Fitted FittedOf(const Conditions& conditions, Random& random) {
  Fitted fitted;
  fitted.size = {conditions.width, conditions.height};
  fitted.capture = Simulate(conditions, random);
  std::vector<BoardView> kept = fitted.capture.views;
  std::vector<RefusedFrame> refused;
  const auto consistent = FitConsistentViews(conditions.board, fitted.size, kept, refused);
  REQUIRE(consistent);
  fitted.fit = consistent->fit;
  fitted.parts = PartsOf(fitted.fit, consistent->consistency, kept, fitted.size);
  fitted.capture.views = std::move(kept);
  return fitted;
}

/// Pulls the corners towards a place by up to `most_px`, within 90 px of it.
void PullBehindDrop(std::vector<BoardView>& views, const lens::Vec2& drop, double most_px) {
  for (BoardView& view : views) {
    for (lens::Vec2& corner : view.corners_px) {
      const lens::Vec2 from = (corner - drop) / 90;
      const double r = from.norm();
      if (r < 1) corner -= 2.6 * most_px * from * (1 - r * r);
    }
  }
}

}  // namespace

TEST_CASE("residuals with nothing but noise have no part fixed in the image") {
  int fields = 0;
  for (const std::uint64_t seed : {71, 72, 73, 74, 75}) {
    Random random(seed);
    const Fitted fitted = FittedOf(Known(random), random);
    CHECK(fitted.parts.image_px < 0.02);
    CHECK(fitted.parts.view_px < 0.02);
    fields += fitted.parts.field_px[0] > 0;
  }
  CHECK(fields <= 1);  // one capture in a hundred
}

TEST_CASE("a drop on the glass bounds the claim, although the corners behind it are outliers") {
  Random random(81);
  Conditions conditions = Known(random);
  conditions.change_views = [](std::vector<BoardView>& views) {
    PullBehindDrop(views, {500, 420}, 2);
  };
  const Fitted fitted = FittedOf(conditions, random);
  CHECK(fitted.parts.field_px[0] > 0.7);
  CHECK(fitted.parts.field_px[0] < 3);
  const LensCalibration c =
      CalibrateLens(conditions.board, fitted.capture.views, fitted.size, CalibrationOptions{});
  CHECK_FALSE(c.accepted);
  REQUIRE_FALSE(c.reasons.empty());
  CHECK(c.reasons.front().find("fixed in the image") != std::string::npos);
}

TEST_CASE("a drop beyond the usable region does no harm within") {
  Random random(83);
  Conditions conditions = Known(random);
  conditions.spread = 0.9;  // corners all over the image
  conditions.change_views = [](std::vector<BoardView>& views) {
    PullBehindDrop(views, {190, 160}, 2);
  };
  const Fitted fitted = FittedOf(conditions, random);
  REQUIRE(fitted.parts.field_px.front() > 0.5);
  CHECK(fitted.parts.field_px.back() < 0.2);
}

TEST_CASE("a glare in a few frames is not fixed in the image") {
  Random random(82);
  Conditions conditions = Known(random);
  conditions.change_views = [](std::vector<BoardView>& views) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (lens::Vec2& corner : views[5 * j].corners_px)
        if ((corner - lens::Vec2(600, 400)).norm() < 60) corner.x() += 3;
    }
  };
  CHECK(FittedOf(conditions, random).parts.field_px[0] < 0.1);
}

TEST_CASE("a lens that depends on how the board was held is found without naming a cause") {
  SECTION("nothing depends on anything: one capture in a hundred") {
    int found = 0;
    for (std::uint64_t seed = 100; seed < 115; ++seed) {
      Random random(seed);
      const Fitted fitted = FittedOf(Known(random), random);
      found +=
          DependenceOnViews(fitted.fit, fitted.capture.views, LensFromShared(fitted.fit.shared),
                            fitted.capture.conditions.board, fitted.size, fitted.fit.dispersion)
              .has_value();
    }
    CHECK(found <= 1);
  }
  SECTION("the distortion drifts with the time") {
    Random random(91);
    Conditions conditions = Known(random);
    conditions.change_camera = [](int j, CameraModel& camera) { camera.k[0] += 0.002 * j; };
    const Fitted fitted = FittedOf(conditions, random);
    const auto found =
        DependenceOnViews(fitted.fit, fitted.capture.views, LensFromShared(fitted.fit.shared),
                          fitted.capture.conditions.board, fitted.size, fitted.fit.dispersion);
    REQUIRE(found);
    CHECK((found->trait == ViewTrait::kTime || found->trait == ViewTrait::kLateHalf));
    CHECK(found->effect_px > 0.3);
    CHECK(found->effect_px < 10);
  }
}

TEST_CASE("pixels that are not square are an error unless they are declared") {
  Random random(95);
  Conditions conditions = Known(random);
  conditions.camera.fy *= 1.006;
  const SimulatedCapture capture = Simulate(conditions, random);
  const image::ImageSize size{conditions.width, conditions.height};
  const LensCalibration c = CalibrateLens(conditions.board, capture.views, size);
  CHECK_FALSE(c.accepted);
  REQUIRE_FALSE(c.reasons.empty());
  INFO(c.reasons.front());
  CHECK(c.reasons.front().find("oblong") != std::string::npos);
  CalibrationOptions declared;
  declared.declared.oblong_pixels = true;
  const LensCalibration accepted = CalibrateLens(conditions.board, capture.views, size, declared);
  CHECK(accepted.accepted);
  CHECK(accepted.lens.fy / accepted.lens.fx == Approx(1.006).margin(5e-4));
}

TEST_CASE("without a limit a capture is accepted with what it proves") {
  Random random(97);
  Conditions conditions = Known(random);
  conditions.noise_px = 0.6;
  conditions.views = 9;
  const SimulatedCapture capture = Simulate(conditions, random);
  const image::ImageSize size{conditions.width, conditions.height};
  const LensCalibration strict = CalibrateLens(conditions.board, capture.views, size);
  REQUIRE_FALSE(strict.accepted);
  CalibrationOptions options;
  options.accept_least = true;
  const LensCalibration least = CalibrateLens(conditions.board, capture.views, size, options);
  REQUIRE(least.accepted);
  CHECK(least.uncertainty.max_px > CalibrationOptions{}.acceptable_px);
  CHECK(least.uncertainty.max_px <= 1280.0 / 400);
  REQUIRE_FALSE(least.notes.empty());
  CHECK(least.notes.front().find(", not to 0.5 px") != std::string::npos);
  const double error_px = LargestError(conditions.camera, test::StatedCamera(least.lens), 1280, 960,
                                       least.usable_radius_px);
  CHECK(error_px < 3 * least.uncertainty.max_px);
}

}  // namespace plumbline::three_principles_test
