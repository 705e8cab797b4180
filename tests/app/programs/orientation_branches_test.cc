// Numbers of a rotation, nearest to the old ones.
#include "app/programs/brands/orientation_branches.h"

#include <array>
#include <catch2/catch.hpp>
#include <numbers>

#include "firmware-like/geometry/units.h"

namespace plumbline::orientation_branches_test {

using namespace plumbline::programs;

namespace {

/// Rz(a) Ry(b) Rx(c) in degrees.
Mat3 Rotation(double a, double b, double c) {
  return (Eigen::AngleAxisd(a * kRadPerDeg, Vec3::UnitZ()) *
          Eigen::AngleAxisd(b * kRadPerDeg, Vec3::UnitY()) *
          Eigen::AngleAxisd(c * kRadPerDeg, Vec3::UnitX()))
      .toRotationMatrix();
}

double LargestChange(std::span<const double> numbers, std::span<const double> old) {
  double largest = 0;
  for (std::size_t i = 0; i < old.size(); ++i) {
    largest = std::max(largest, std::abs(numbers[i] - old[i]));
  }
  return largest;
}

}  // namespace

TEST_CASE("angles stay near the old ones, also at a middle angle of 90 deg and beyond a turn") {
  for (const std::array<double, 3>& abc : {std::array{10.0, 20.0, 30.0},
                                           {10.0, 90.0, 30.0},
                                           {-170.0, -90.0, 75.0},
                                           {179.9, 0.0, -179.9},
                                           {400.0, 100.0, -300.0},
                                           {12.0, 89.9999999999, -3.0}}) {
    CAPTURE(abc[0], abc[1], abc[2]);
    const std::array rpy = {abc[2], abc[1], abc[0]};
    const Mat3 R = Rotation(abc[0], abc[1], abc[2]);
    CHECK((*RotationFromAbcDegrees(abc) - R).norm() < 1e-12);
    CHECK((*RotationFromRpyDegrees(rpy) - R).norm() < 1e-12);
    CHECK(LargestChange(AbcDegreesNear(R, abc), abc) < 1e-5);
    CHECK(LargestChange(RpyDegreesNear(R, rpy), rpy) < 1e-5);
    // A turn about the tool's own x axis.
    const Mat3 turned = R * Rotation(0, 0, 0.01);
    const auto numbers = AbcDegreesNear(turned, abc);
    CHECK((Rotation(numbers[0], numbers[1], numbers[2]) - turned).norm() < 1e-9);
    CHECK(LargestChange(numbers, abc) < 0.0101);
  }
}

TEST_CASE("-180 deg stays -180, and a turn beyond it comes back at 180") {
  const std::array old = {0.0, 0.0, -180.0};
  CHECK(AbcDegreesNear(Rotation(0, 0, 180), old)[2] == Approx(-180));
  CHECK(AbcDegreesNear(Rotation(0, 0, 179.5), old)[2] == Approx(179.5));
  CHECK(AbcDegreesNear(Rotation(0, 0, -170), std::array{0.0, 0.0, 185.0})[2] == Approx(190));
}

TEST_CASE("a rotation vector keeps its whole turns") {
  constexpr double kTurn = 2 * std::numbers::pi;
  const Vec3 axis = Vec3(1, 2, 2) / 3;
  for (const double angle : {0.5, 3.1, 3.2, -3.1, kTurn + 0.3, -kTurn - 0.3, kTurn}) {
    CAPTURE(angle);
    const Vec3 v = angle * axis;
    const std::array old = {v.x(), v.y(), v.z()};
    CHECK(LargestChange(VectorNear(*RotationFromVectorNumbers(old), old), old) < 1e-7);
  }
}

TEST_CASE("a quaternion keeps its sign") {
  const std::array old = {-0.5, 0.5, 0.5, -0.5};
  const Mat3 R = Eigen::Quaterniond(-0.5, 0.5, 0.5, -0.5).toRotationMatrix();
  CHECK(LargestChange(QuaternionNear(R, old), old) < 1e-12);
}

}  // namespace plumbline::orientation_branches_test
