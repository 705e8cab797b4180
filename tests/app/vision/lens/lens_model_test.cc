// Board projection, its derivatives, and projection uncertainty.
#include "app/vision/lens/lens_model.h"

#include <catch2/catch.hpp>
#include <random>

#include "app/vision/lens/projection_uncertainty.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/lens_captures/camera_model.h"

namespace plumbline::lens_model_test {

using namespace plumbline::vision;

namespace {

SharedVector SomeShared() {
  SharedVector s = SharedOfLens({1500, 1510, 930, 520, -0.12, 0.05, 0.001, -0.0008, 0.02});
  s[kBowX] = 0.8;
  s[kBowY] = -0.5;
  s[kBowXY] = 0.3;
  return s;
}

}  // namespace

TEST_CASE("the lens projects points as the renderer does") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> U(-1, 1);
  for (const double f : {1000.0, 1700.0, 5000.0, 12000.0}) {
    const renderer::Camera camera = renderer::ZoomLens(f);
    for (int k = 0; k < 50; ++k) {
      const Vec3 p(U(random) * 900 / f, U(random) * 500 / f, 1);
      const lens::Vec2 pixel = lens::Project(test::LensOfCamera(camera), p);
      CHECK((pixel - renderer::PixelOf(camera, p)).norm() < 1e-9);
      const auto back = lens::NormalisedOfPixel(test::LensOfCamera(camera), pixel);
      REQUIRE(back);
      CHECK((*back - p.head<2>()).norm() * f < 1e-6);
    }
  }
}

TEST_CASE("a pixel beyond the fold of the polynomial has no direction") {
  const lens::Lens folding{1000, 1000, 500, 500, -0.5, 0, 0, 0, 0};
  CHECK_FALSE(lens::NormalisedOfPixel(folding, {1200, 500}));
}

namespace {

/// One lens of each model.
std::vector<lens::Lens> LensOfEachModel() {
  lens::Lens usual{1500, 1510, 930, 520, -0.12, 0.05, 0.001, -0.0008, 0.02};
  lens::Lens rational = usual, prism = usual, fisheye = usual;
  rational.k4 = 0.3, rational.k5 = -0.05, rational.k6 = 0.01;
  prism.s1 = 0.004, prism.s2 = -0.01, prism.s3 = 0.006, prism.s4 = 0.02;
  fisheye.fisheye = true;
  fisheye.p1 = fisheye.p2 = 0;
  fisheye.k4 = -0.003;
  return {usual, rational, prism, fisheye};
}

}  // namespace

TEST_CASE("every lens model projects as an independent implementation, and back") {
  for (const lens::Lens& lens : LensOfEachModel()) {
    INFO(lens::ModelName(lens::ModelOf(lens)));
    for (const lens::Vec2& n :
         {lens::Vec2(0, 0), lens::Vec2(1e-9, 0), lens::Vec2(0.31, -0.2), lens::Vec2(-0.5, 0.35)}) {
      const lens::Vec2 pixel = lens::PixelOfNormalised(lens, n);
      const Vec3 direction = Vec3(n.x(), n.y(), 1).normalized();
      CHECK((pixel - test::StatedCamera(lens).PixelOfDirection(direction)).norm() < 1e-6);
      const auto back = lens::NormalisedOfPixel(lens, pixel);
      REQUIRE(back);
      CHECK((*back - n).norm() < 1e-9);
    }
  }
}

TEST_CASE("derivatives of a pixel agree with finite differences in every lens model") {
  for (const lens::Lens& lens : LensOfEachModel()) {
    INFO(lens::ModelName(lens::ModelOf(lens)));
    const lens::Vec2 n(0.31, -0.2);
    const auto by_lens = lens::PixelByLens(lens, n);
    for (int k = 0; k < lens::kLensParameters; ++k) {
      if (lens.fisheye && (k == kP1 || k == kP2 || k > 9)) {
        CHECK(by_lens.col(k).norm() == 0);
        continue;
      }
      lens::LensVector up = lens::VectorOfLens(lens), down = up;
      up[k] += 1e-4;
      down[k] -= 1e-4;
      const lens::Vec2 slope =
          (lens::PixelOfNormalised(lens::LensOfVector(up, lens.fisheye), n) -
           lens::PixelOfNormalised(lens::LensOfVector(down, lens.fisheye), n)) /
          2e-4;
      INFO(lens::kLensParameterNames[k]);
      CHECK((slope - by_lens.col(k)).norm() < 1e-6 * (1 + slope.norm()));
    }
    const Eigen::Matrix2d J = lens::PixelJacobian(lens, n);
    for (int axis = 0; axis < 2; ++axis) {
      const lens::Vec2 step = 1e-6 * lens::Vec2::Unit(axis);
      const lens::Vec2 slope = (lens::PixelOfNormalised<double>(lens, n + step) -
                                lens::PixelOfNormalised<double>(lens, n - step)) /
                               2e-6;
      CHECK((slope - J.col(axis)).norm() < 1e-5 * slope.norm());
    }
  }
}

TEST_CASE(
    "coefficients are read and written in OpenCV's order, and a lens is usable in its region") {
  for (const lens::Lens& lens : LensOfEachModel()) {
    const std::vector<double> values = lens::DistortionOf(lens);
    lens::Lens read{lens.fx, lens.fy, lens.cx, lens.cy};
    REQUIRE(lens::SetDistortion(values, lens.fisheye, read));
    CHECK(lens::VectorOfLens(read) == lens::VectorOfLens(lens));
  }
  lens::Lens lens;
  CHECK_FALSE(lens::SetDistortion({1, 2, 3}, false, lens));
  CHECK_FALSE(lens::SetDistortion({1, 2, 3, 4, 5}, true, lens));
  lens::KnownLens known;
  known.size = {640, 480};
  CHECK(lens::UsableEverywhere(known));
  CHECK(lens::UsableAt(known, {0, 0}));
  CHECK(lens::UsableShare(known) == 1);
  known.usable_radius_px = 240;
  CHECK_FALSE(lens::UsableEverywhere(known));
  CHECK(lens::UsableAt(known, {319.5, 1}));
  CHECK_FALSE(lens::UsableAt(known, {20, 239.5}));
  CHECK(lens::UsableShare(known) == Approx(3.14159 * 240 * 240 / (640 * 480)).epsilon(0.01));
}

TEST_CASE("derivatives of the board's pixels agree with finite differences") {
  const target::Board board{5, 4, 0.03};
  const Mat3 R = Eigen::AngleAxisd(0.4, Vec3(0.5, -0.8, 0.2).normalized()).toRotationMatrix();
  const SharedVector shared = SomeShared();
  const Vec3 turn(0.05, -0.1, 0.07), p(-0.05, -0.04, 0.6);
  std::vector<lens::Vec2> pixels, moved;
  std::vector<double> by_shared(40 * kSharedCount), by_pose(40 * 6);
  REQUIRE(BoardPixels(board, shared, R, turn, p, pixels, by_shared.data(), by_pose.data()));
  const auto check = [&](int column, int columns, const std::vector<double>& derivative,
                         double step, const auto& at) {
    std::vector<lens::Vec2> plus, minus;
    REQUIRE(at(step, plus));
    REQUIRE(at(-step, minus));
    for (int k = 0; k < board.corners(); ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        const double numeric = (plus[k][axis] - minus[k][axis]) / (2 * step);
        const double analytic = derivative[(2 * k + axis) * columns + column];
        CHECK(analytic == Approx(numeric).epsilon(1e-5).margin(1e-4));
      }
    }
  };
  for (int c = 0; c < kSharedCount; ++c) {
    INFO("shared parameter " << c);
    const double step = 1e-5 * std::max(1.0, std::abs(shared[c]));
    check(c, kSharedCount, by_shared, step, [&](double by, std::vector<lens::Vec2>& out) {
      SharedVector other = shared;
      other[c] += by;
      return BoardPixels(board, other, R, turn, p, out, nullptr, nullptr);
    });
  }
  for (int c = 0; c < 6; ++c) {
    INFO("pose parameter " << c);
    check(c, 6, by_pose, 1e-6, [&](double by, std::vector<lens::Vec2>& out) {
      Vec3 w = turn, t = p;
      (c < 3 ? w[c] : t[c - 3]) += by;
      return BoardPixels(board, shared, R, w, t, out, nullptr, nullptr);
    });
  }
}

TEST_CASE("a board behind the camera has no pixels") {
  std::vector<lens::Vec2> pixels;
  CHECK_FALSE(BoardPixels(target::Board{}, SomeShared(), Mat3::Identity(), Vec3::Zero(),
                          Vec3(0, 0, -1), pixels, nullptr, nullptr));
}

TEST_CASE("errors that a camera rotation compensates do not count as projection uncertainty") {
  const lens::Lens lens{5000, 5000, 960, 540};
  LensMatrix covariance = LensMatrix::Zero();
  covariance(kCx, kCx) = covariance(kCy, kCy) = 9;  // 3 px
  const double centre = ProjectionUncertaintyOf(lens, covariance, {1920, 1080}).max_px;
  covariance.setZero();
  covariance(kFx, kFx) = covariance(kFy, kFy) = covariance(kFx, kFy) = covariance(kFy, kFx) = 25;
  const double focal = ProjectionUncertaintyOf(lens, covariance, {1920, 1080}).max_px;
  CHECK(centre < 0.2);                         // of 3 px nearly all is a turn
  CHECK(focal == Approx(1.10).epsilon(0.05));  // 5 px of 5000 at 1101 px from the middle
  // At one distance, a translation along the axis also compensates the focal length.
  CHECK(ProjectionUncertaintyOf(lens, covariance, {1920, 1080}, 1.5).max_px < 0.02);
}

TEST_CASE("the difference between two lenses is evaluated after the best camera rotation") {
  const lens::Lens lens{2000, 2000, 960, 540};
  lens::Lens other = lens;
  other.cx += 2;
  CHECK(LargestDifference(lens, other, {1920, 1080}) < 0.6);
  other = lens;
  other.fx *= 1.001;
  other.fy *= 1.001;
  CHECK(LargestDifference(lens, other, {1920, 1080}) == Approx(1.10).epsilon(0.05));
  CHECK(LargestDifference(lens, lens, {1920, 1080}) < 1e-9);
}

}  // namespace plumbline::lens_model_test
