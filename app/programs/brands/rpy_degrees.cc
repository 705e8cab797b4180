#include "app/programs/brands/rpy_degrees.h"

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
  const double nearest = angle + Whole((old - angle) / 360);
  if (std::abs(old) > 180 || std::abs(nearest) <= 180) return nearest;
  return nearest - Whole(nearest / 360);
}

double LargestChange(const Angles& angles, const Angles& old) {
  double largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double change = angles[i] - old[i];
    largest = std::max(largest, std::abs(change - Whole(change / 360)));
  }
  return largest;
}

}  // namespace

Result<Mat3> RotationFromRpyDegrees(std::span<const double> numbers) {
  if (numbers.size() != 3 ||
      !std::ranges::all_of(numbers, [](double n) { return std::isfinite(n); }))
    return Error{"an orientation has three angles"};
  return RotationFromRollPitchYaw(Vec3(numbers[0], numbers[1], numbers[2]) * kRadPerDeg);
}

std::vector<double> RpyDegreesNear(const Mat3& R, std::span<const double> old) {
  Angles before{};
  std::copy_n(old.begin(), std::min<std::size_t>(old.size(), 3), before.begin());
  Angles best{};
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), cos_pitch) * kDegPerRad;
  if (cos_pitch < 1e-7) {
    // R = Rz(yaw) Ry(+-90 deg) Rx(roll) leaves yaw -+ roll: with roll as before, yaw follows.
    const double roll = before[0] * kRadPerDeg;
    const Mat3 rest = R * RotationFromRollPitchYaw(Vec3(roll, 0, 0)).transpose();
    best = {before[0], pitch, std::atan2(-rest(0, 1), rest(1, 1)) * kDegPerRad};
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

}  // namespace plumbline::programs
