// Orientations as the numbers of robot programs: one rotation has many, and the nearest to the old
// ones are written.
#pragma once

#include <span>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

// Every ..Near() returns numbers of R. Missing old numbers count as 0.

/// R = Rz(numbers[2]) Ry(numbers[1]) Rx(numbers[0]), in degrees: W, P, R of FANUC and Rx, Ry, Rz of
/// Yaskawa. Error if there are not three finite numbers.
Result<Mat3> RotationFromRpyDegrees(std::span<const double> numbers);

/// Of the two solutions (roll, pitch, yaw) and (roll + 180, 180 - pitch, yaw + 180) and their whole
/// turns, the one with the smallest largest change [deg]; old angles within -180..180 stay within.
/// At pitch = 90 + k 180, where only roll - yaw or roll + yaw is determined, both change by the
/// same amount.
std::vector<double> RpyDegreesNear(const Mat3& R, std::span<const double> old);

/// The same for A, B, C of KUKA, which are yaw, pitch, roll.
Result<Mat3> RotationFromAbcDegrees(std::span<const double> numbers);
std::vector<double> AbcDegreesNear(const Mat3& R, std::span<const double> old);

/// R = exp([v]x) of a rotation vector v [rad]. Error if there are not three finite numbers.
Result<Mat3> RotationFromVectorNumbers(std::span<const double> numbers);

/// Of the rotation vectors of R, which differ by whole turns about its axis, the nearest.
std::vector<double> VectorNear(const Mat3& R, std::span<const double> old);

/// Of the two unit quaternions (w, x, y, z) of R, the nearer.
std::vector<double> QuaternionNear(const Mat3& R, std::span<const double> old);

}  // namespace plumbline::programs
