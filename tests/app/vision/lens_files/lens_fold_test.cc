// Radius at which a distortion polynomial folds back.
#include "app/vision/lens_files/lens_fold.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace plumbline::lens_fold_test {

using namespace plumbline::vision;

namespace {

lens::Lens LensOf(double f, bool fisheye, double k1, const image::ImageSize& size) {
  lens::Lens lens;
  lens.fx = lens.fy = f;
  lens.cx = 0.5 * (size.width - 1);
  lens.cy = 0.5 * (size.height - 1);
  lens.k1 = k1;
  lens.fisheye = fisheye;
  return lens;
}

}  // namespace

TEST_CASE("a fisheye polynomial that folds inside the image, and not outside of it") {
  // 1 + 3 k1 t^2 = 0 at t = 1.2910, where t (1 + k1 t^2) = 0.86066
  const image::ImageSize large{1280, 960}, small{640, 480};
  const auto fold = FoldInside(LensOf(500, true, -0.2, large), large);
  REQUIRE(fold);
  CHECK(fold->angle_rad == Approx(1.2910).margin(1e-3));
  CHECK(fold->radius_px == Approx(430.33).margin(0.1));
  CHECK(fold->corner_px == Approx(800).margin(0.1));
  CHECK_FALSE(FoldInside(LensOf(500, true, -0.2, small), small));
  CHECK_FALSE(FoldInside(LensOf(500, true, 0.05, large), large));
  CHECK_THAT(FoldNote(LensOf(500, true, -0.2, large), large),
             Catch::Contains("the fisheye distortion folds back 430 px from the centre, 74.0 deg"));
  CHECK(FoldNote(LensOf(500, true, -0.2, small), small).empty());
}

TEST_CASE("a fisheye that folds behind the plane of the lens, in the corners of its image") {
  // 1 + 3 k1 t^2 = 0 at t = 95 deg, where t (1 + k1 t^2) = 2 t / 3
  const double fold_rad = 95 * std::numbers::pi / 180;
  const image::ImageSize size{1280, 960};
  const auto fold = FoldInside(LensOf(400, true, -1 / (3 * fold_rad * fold_rad), size), size);
  REQUIRE(fold);
  CHECK(fold->angle_rad == Approx(fold_rad).margin(1e-3));
  CHECK(fold->radius_px == Approx(400 * 2 * fold_rad / 3).margin(0.1));
  // An equidistant fisheye reaches its corners at 115 deg without folding.
  CHECK_FALSE(FoldInside(LensOf(400, true, 0, size), size));
}

TEST_CASE("k1 alone folds at r = 1 / sqrt(-3 k1), where r (1 + k1 r^2) = 2 r / 3") {
  const image::ImageSize size{1600, 1200};
  const auto fold = FoldInside(LensOf(1000, false, -0.3, size), size);
  REQUIRE(fold);
  CHECK(fold->radius_px == Approx(1000 * 2 / 3.0 / std::sqrt(0.9)).margin(0.5));
  CHECK_FALSE(FoldInside(LensOf(2000, false, -0.3, size), size));
  lens::Lens rational = LensOf(1000, false, 0, size);
  rational.k4 = 2;  // r / (1 + 2 r^2) is largest at r = 0.7071: 0.35355
  REQUIRE(FoldInside(rational, size));
  CHECK(FoldInside(rational, size)->radius_px == Approx(353.55).margin(0.1));
}

}  // namespace plumbline::lens_fold_test
