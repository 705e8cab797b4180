// Board projection, its derivatives, and projection uncertainty.
#include "app/lens/lens_model.h"

#include <catch2/catch.hpp>
#include <random>

#include "app/lens/projection_uncertainty.h"
#include "tests/app/lens/rendered_views.h"

namespace plumbline::lens_model_test {

using namespace plumbline::lens;

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
      const Vec2 pixel = Project(test::LensOfCamera(camera), p);
      CHECK((pixel - renderer::PixelOf(camera, p)).norm() < 1e-9);
      const auto back = NormalisedOfPixel(test::LensOfCamera(camera), pixel);
      REQUIRE(back);
      CHECK((*back - p.head<2>()).norm() * f < 1e-6);
    }
  }
}

TEST_CASE("a pixel beyond the fold of the polynomial has no direction") {
  const Lens folding{1000, 1000, 500, 500, -0.5, 0, 0, 0, 0};
  CHECK_FALSE(NormalisedOfPixel(folding, {1200, 500}));
}

TEST_CASE("derivatives of the board's pixels agree with finite differences") {
  const Board board{5, 4, 0.03};
  const Mat3 R = Eigen::AngleAxisd(0.4, Vec3(0.5, -0.8, 0.2).normalized()).toRotationMatrix();
  const SharedVector shared = SomeShared();
  const Vec3 turn(0.05, -0.1, 0.07), p(-0.05, -0.04, 0.6);
  std::vector<Vec2> pixels, moved;
  std::vector<double> by_shared(40 * kSharedCount), by_pose(40 * 6);
  REQUIRE(BoardPixels(board, shared, R, turn, p, pixels, by_shared.data(), by_pose.data()));
  const auto check = [&](int column, int columns, const std::vector<double>& derivative,
                         double step, const auto& at) {
    std::vector<Vec2> plus, minus;
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
    check(c, kSharedCount, by_shared, step, [&](double by, std::vector<Vec2>& out) {
      SharedVector other = shared;
      other[c] += by;
      return BoardPixels(board, other, R, turn, p, out, nullptr, nullptr);
    });
  }
  for (int c = 0; c < 6; ++c) {
    INFO("pose parameter " << c);
    check(c, 6, by_pose, 1e-6, [&](double by, std::vector<Vec2>& out) {
      Vec3 w = turn, t = p;
      (c < 3 ? w[c] : t[c - 3]) += by;
      return BoardPixels(board, shared, R, w, t, out, nullptr, nullptr);
    });
  }
}

TEST_CASE("a board behind the camera has no pixels") {
  std::vector<Vec2> pixels;
  CHECK_FALSE(BoardPixels(Board{}, SomeShared(), Mat3::Identity(), Vec3::Zero(), Vec3(0, 0, -1),
                          pixels, nullptr, nullptr));
}

TEST_CASE("errors that a camera rotation compensates do not count as projection uncertainty") {
  const Lens lens{5000, 5000, 960, 540};
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
  const Lens lens{2000, 2000, 960, 540};
  Lens other = lens;
  other.cx += 2;
  CHECK(LargestDifference(lens, other, {1920, 1080}) < 0.6);
  other = lens;
  other.fx *= 1.001;
  other.fy *= 1.001;
  CHECK(LargestDifference(lens, other, {1920, 1080}) == Approx(1.10).epsilon(0.05));
  CHECK(LargestDifference(lens, lens, {1920, 1080}) < 1e-9);
}

}  // namespace plumbline::lens_model_test
