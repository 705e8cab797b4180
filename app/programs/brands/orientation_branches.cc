#include "app/programs/brands/orientation_branches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace {

using Angles = std::array<double, 3>;

double Whole(double turns) {
  return 360 * std::round(turns);
}

/// `angle` plus whole turns: nearest to the old one, but within -180..180 if the old one is.
double NearestTurn(double angle, double old) {
  constexpr double kRounding = 1e-9;  // -180 stays -180
  const double nearest = angle + Whole((old - angle) / 360);
  if (std::abs(old) > 180 || std::abs(nearest) <= 180 + kRounding) return nearest;
  return nearest - Whole(nearest / 360);
}

double LargestChange(const Angles& angles, const Angles& old) {
  double largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    largest = std::max(largest, std::abs(std::remainder(angles[i] - old[i], 360.0)));
  }
  return largest;
}

bool AreFinite(std::span<const double> numbers, std::size_t count) {
  return numbers.size() == count &&
         std::ranges::all_of(numbers, [](double n) { return std::isfinite(n); });
}

template <std::size_t kSize>
std::array<double, kSize> Padded(std::span<const double> numbers) {
  std::array<double, kSize> padded{};
  std::copy_n(numbers.begin(), std::min(numbers.size(), kSize), padded.begin());
  return padded;
}

}  // namespace

Result<Mat3> RotationFromRpyDegrees(std::span<const double> numbers) {
  if (!AreFinite(numbers, 3)) return Error{"an orientation has three angles"};
  return RotationFromRollPitchYaw(Vec3(numbers[0], numbers[1], numbers[2]) * kRadPerDeg);
}

std::vector<double> RpyDegreesNear(const Mat3& R, std::span<const double> old) {
  // Below this, rounding errors of R change roll and yaw more than setting pitch to 90 deg does.
  constexpr double kSingularCosine = 1e-8;
  const auto before = Padded<3>(old);
  Angles best{};
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), cos_pitch) * kDegPerRad;
  if (cos_pitch < kSingularCosine) {
    // Rz(yaw) Ry(+-90 deg) Rx(roll): R(0,1) = -sin(yaw -+ roll), R(1,1) = cos(yaw -+ roll).
    const double sign = pitch > 0 ? 1 : -1;
    const double determined = std::atan2(-R(0, 1), R(1, 1)) * kDegPerRad;
    const double change = std::remainder(determined - (before[2] - sign * before[0]), 360.0) / 2;
    best = {before[0] - sign * change, pitch, before[2] + change};
  } else {
    const double roll = std::atan2(R(2, 1), R(2, 2)) * kDegPerRad;
    const double yaw = std::atan2(R(1, 0), R(0, 0)) * kDegPerRad;
    const Angles first = {roll, pitch, yaw}, second = {roll + 180, 180 - pitch, yaw + 180};
    best = LargestChange(second, before) < LargestChange(first, before) ? second : first;
  }
  std::vector<double> numbers(3);
  for (std::size_t i = 0; i < 3; ++i) numbers[i] = NearestTurn(best[i], before[i]);
  return numbers;
}

Result<Mat3> RotationFromAbcDegrees(std::span<const double> numbers) {
  std::vector<double> rpy(numbers.begin(), numbers.end());
  std::ranges::reverse(rpy);
  return RotationFromRpyDegrees(rpy);
}

std::vector<double> AbcDegreesNear(const Mat3& R, std::span<const double> old) {
  auto rpy = Padded<3>(old);
  std::ranges::reverse(rpy);
  std::vector<double> numbers = RpyDegreesNear(R, rpy);
  std::ranges::reverse(numbers);
  return numbers;
}

Result<Mat3> RotationFromVectorNumbers(std::span<const double> numbers) {
  if (!AreFinite(numbers, 3)) return Error{"a rotation vector has three numbers"};
  return RotationFromVector(Vec3(numbers[0], numbers[1], numbers[2]));
}

std::vector<double> VectorNear(const Mat3& R, std::span<const double> old) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const auto padded = Padded<3>(old);
  const Vec3 before(padded[0], padded[1], padded[2]);
  Vec3 v = VectorFromRotation(R);
  const double angle = v.norm();
  if (angle > 1e-12) {
    const Vec3 axis = v / angle;
    v += axis * (kTurn * std::round((axis.dot(before) - angle) / kTurn));
  } else if (const double turns = std::round(before.norm() / kTurn); turns > 0) {
    v += before.normalized() * (kTurn * turns);  // without a turn, every axis is one
  }
  return {v.x(), v.y(), v.z()};
}

std::vector<double> QuaternionNear(const Mat3& R, std::span<const double> old) {
  const auto padded = Padded<4>(old);
  const Eigen::Quaterniond q(R), before(padded[0], padded[1], padded[2], padded[3]);
  const double sign = q.dot(before) < 0 ? -1 : 1;
  return {sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z()};
}

}  // namespace plumbline::programs
