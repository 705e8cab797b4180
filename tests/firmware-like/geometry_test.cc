#include <catch2/catch.hpp>
#include <numbers>
#include <random>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::geometry_test {

TEST_CASE("rotation vector and matrix conversions are inverse, also near 0 and near pi") {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const double angle : {0.0, 1e-12, 1e-7, 9e-5, 1.1e-4, 0.5, 3.0, std::numbers::pi - 1e-7}) {
    const Vec3 axis = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 v = angle * axis;
    const Mat3 R = RotationFromVector(v);
    CAPTURE(angle);
    CHECK((R - Eigen::AngleAxisd(angle, axis).toRotationMatrix()).norm() < 1e-14);
    CHECK((VectorFromRotation(R) - v).norm() < 1e-9);
  }
}

TEST_CASE("the three conventions describe the same rotation") {
  const Mat3 R = (Eigen::AngleAxisd(0.7, Vec3::UnitZ()) * Eigen::AngleAxisd(-0.4, Vec3::UnitY()) *
                  Eigen::AngleAxisd(1.2, Vec3::UnitX()))
                     .toRotationMatrix();
  const Vec3 rpy = AnglesFromRotation(R, OrientationConvention::kRollPitchYaw);
  CHECK((rpy - Vec3(1.2, -0.4, 0.7)).norm() < 1e-14);
  const Vec3 abc = AnglesFromRotation(R, OrientationConvention::kAbc);
  CHECK((abc - Vec3(0.7, -0.4, 1.2)).norm() < 1e-14);
  for (const auto convention :
       {OrientationConvention::kRotationVector, OrientationConvention::kRollPitchYaw,
        OrientationConvention::kAbc, OrientationConvention::kQuaternion}) {
    CHECK((RotationFromAngles(AnglesFromRotation(R, convention), convention) - R).norm() < 1e-13);
  }
}

TEST_CASE("the rotation survives a round trip at gimbal lock") {
  const Mat3 R = RotationFromRollPitchYaw({0.3, std::numbers::pi / 2, 1.1});
  CHECK((RotationFromRollPitchYaw(RollPitchYawFromRotation(R)) - R).norm() < 1e-9);
}

TEST_CASE("the nearest rotation is proper, and nearer than others") {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 20; ++k) {
    const Mat3 M = Mat3::NullaryExpr([&] { return normal(random); });
    const Mat3 R = NearestRotation(M);
    CAPTURE(k, M.determinant());
    CHECK((R * R.transpose() - Mat3::Identity()).norm() < 1e-14);
    CHECK(R.determinant() == Approx(1));
    for (int axis = 0; axis < 3; ++axis) {
      for (const double angle : {1e-3, -1e-3, 1.0, std::numbers::pi}) {
        const Mat3 other = R * RotationFromVector(angle * Vec3::Unit(axis));
        CHECK((other - M).norm() >= (R - M).norm());
      }
    }
  }
  double smallest = -1;
  CHECK((NearestRotation(Vec3(3, 2, 0.5).asDiagonal(), &smallest) - Mat3::Identity()).norm() <
        1e-14);
  CHECK(smallest == Approx(0.5));
}

TEST_CASE("z is turned onto a direction about an axis without z, also onto -z and next to it") {
  for (const Vec3& direction : {Vec3(0, 0, 3), Vec3(1, 0, 0), Vec3(0, -2, 0.5), Vec3(1e-9, 0, -1),
                                Vec3(2e-6, 0, -1), Vec3(1e-4, 3e-4, -1), Vec3(0, 0, -1)}) {
    const Mat3 R = RotationOfZOnto(direction);
    CAPTURE(direction.transpose());
    CHECK((R.col(2) - direction.normalized()).norm() < 1e-14);
    CHECK((R * R.transpose() - Mat3::Identity()).norm() < 1e-14);
    CHECK(R.determinant() == Approx(1));
    CHECK(std::abs(VectorFromRotation(R).z()) < 1e-6);
  }
}

}  // namespace plumbline::geometry_test
