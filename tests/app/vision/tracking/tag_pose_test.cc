// Pose estimation from exact and noisy corners.
#include "app/vision/tracking/tag_pose.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::tag_pose_test {

using namespace plumbline::vision;

namespace {

constexpr double kSide_m = 0.08;

lens::KnownLens SomeLens(double f) {
  lens::KnownLens known;
  known.lens = {f, 1.001 * f, 955, 545, -0.05, 0.02, 0.0005, -0.0003, 0.001};
  return known;
}

Pose RandomPose(std::mt19937_64& random, double depth, double most_tilt) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3 axis = Vec3(uniform(random), uniform(random), 0).normalized();
  return {RotationFromVector(most_tilt * uniform(random) * axis) *
              RotationFromVector(Vec3(0, 0, 3 * uniform(random))),
          depth * Vec3(0.2 * uniform(random), 0.1 * uniform(random), 1)};
}

Corners Seen(const lens::Lens& lens, const Pose& X, double sd, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, sd);
  Corners pixels;
  const auto own = CornersInTag(kSide_m);
  for (int k = 0; k < 4; ++k) {
    pixels[k] = Project<double>(lens, X * own[k]);
    if (sd > 0) pixels[k] += lens::Vec2(noise(random), noise(random));
  }
  return pixels;
}

Vec6 ErrorOf(const Pose& estimated, const Pose& truth) {
  Vec6 error;
  error << truth.p - estimated.p, VectorFromRotation(truth.R * estimated.R.transpose());
  return error;
}

}  // namespace

TEST_CASE("Exact corners give the exact pose, and one of the square's two poses is that") {
  std::mt19937_64 random(1);
  const lens::KnownLens known = SomeLens(1500);
  for (int round = 0; round < 300; ++round) {
    const Pose X = RandomPose(random, 0.3 + 0.01 * round, 1.2);
    const Corners pixels = Seen(known.lens, X, 0, random);
    std::array<lens::Vec2, 4> normalised;
    for (int k = 0; k < 4; ++k) normalised[k] = *lens::NormalisedOfPixel(known.lens, pixels[k]);
    const auto two = PosesOfSquare(normalised, kSide_m);
    REQUIRE(two.size() == 2);
    CHECK(ErrorOf(two[0], X).norm() < 1e-5);
    const auto poses = PosesOfTag(known, pixels, 0.01 * CornersCovariance::Identity(), kSide_m);
    REQUIRE(poses);
    CHECK(ErrorOf(poses->best.X_CK, X).norm() < 1e-6);
  }
}

TEST_CASE("Errors match the stated covariance and reach the Cramer-Rao bound of the corners") {
  std::mt19937_64 random(2);
  const lens::KnownLens known = SomeLens(2500);
  const double sd = 0.05;
  double whitened = 0, squares = 0, bound = 0;
  int count = 0;
  for (int round = 0; round < 400; ++round) {
    const Pose X = RandomPose(random, 1.5, 0.9);
    // Nearly frontal tags have two minima that noise merges, so the bound does not apply.
    if (std::abs(X.R(2, 2)) > 0.95) continue;
    const auto poses = PosesOfTag(known, Seen(known.lens, X, sd, random),
                                  sd * sd * CornersCovariance::Identity(), kSide_m);
    REQUIRE(poses);
    if (poses->ambiguous()) continue;
    const Vec6 error = ErrorOf(poses->best.X_CK, X);
    whitened += error.dot(poses->best.covariance.ldlt().solve(error)) / 6;
    squares += error.head<3>().squaredNorm();
    bound += poses->best.covariance.topLeftCorner<3, 3>().trace();
    ++count;
  }
  CHECK(count > 200);
  CHECK(std::sqrt(whitened / count) == Approx(1).margin(0.1));
  CHECK(std::sqrt(squares / bound) < 1.2);
}

TEST_CASE("The lens covariance is propagated into the pose covariance") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1);
  lens::KnownLens known = SomeLens(2500);
  known.covariance(0, 0) = known.covariance(1, 1) = 25;
  known.covariance(2, 2) = known.covariance(3, 3) = 4;
  const Pose X = RandomPose(random, 1.5, 0.5);
  double whitened = 0;
  for (int round = 0; round < 300; ++round) {
    lens::Lens truth = known.lens;
    truth.fx += 5 * normal(random);
    truth.fy += 5 * normal(random);
    truth.cx += 2 * normal(random);
    truth.cy += 2 * normal(random);
    const auto fit = RefinePose(known,
                                {{CornersInTag(kSide_m), Seen(truth, X, 0.02, random),
                                  4e-4 * CornersCovariance::Identity()}},
                                X);
    REQUIRE(fit);
    const Vec6 error = ErrorOf(fit->X_CK, X);
    whitened += error.dot(fit->covariance.ldlt().solve(error)) / 6;
  }
  CHECK(std::sqrt(whitened / 300) == Approx(1).margin(0.15));
}

TEST_CASE("A far tag with inseparable poses is ambiguous, never confidently wrong") {
  std::mt19937_64 random(4);
  const lens::KnownLens known = SomeLens(1500);
  int ambiguous = 0, wrong = 0;
  for (int round = 0; round < 300; ++round) {
    const Pose X = RandomPose(random, 4, 0.7);
    const auto poses = PosesOfTag(known, Seen(known.lens, X, 0.1, random),
                                  0.01 * CornersCovariance::Identity(), kSide_m);
    REQUIRE(poses);
    const Mat3 rotation = poses->best.covariance.bottomRightCorner<3, 3>();
    ambiguous += poses->ambiguous() ? 1 : 0;
    wrong +=
        !poses->ambiguous() && AngleBetween(poses->best.X_CK, X) > 6 * std::sqrt(rotation.trace())
            ? 1
            : 0;
  }
  CHECK(ambiguous > 30);
  CHECK(wrong == 0);
}

TEST_CASE("Corners that are not a square's give no pose") {
  const lens::KnownLens known = SomeLens(1500);
  Corners line;
  for (int k = 0; k < 4; ++k) line[k] = lens::Vec2(100 + 20 * k, 100 + 20 * k);
  CHECK_FALSE(PosesOfTag(known, line, CornersCovariance::Identity(), kSide_m));
}

}  // namespace plumbline::tag_pose_test
