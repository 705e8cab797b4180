// Orientations as three angles in degrees about the fixed axes x, y and z.
#pragma once

#include <span>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

/// R = Rz(numbers[2]) Ry(numbers[1]) Rx(numbers[0]), in degrees: W, P, R of FANUC and Rx, Ry, Rz of
/// Yaskawa. Error if there are not three finite numbers.
Result<Mat3> RotationFromRpyDegrees(std::span<const double> numbers);

/// The three angles of R [deg] that are nearest to the old ones. Of the two solutions and their
/// whole turns the one with the smallest largest change; old angles within -180..180 deg stay
/// within. Where the outer angles turn about one axis (the middle one within 1e-7 rad of +-90 deg)
/// the first keeps its old value.
std::vector<double> RpyDegreesNear(const Mat3& R, std::span<const double> old);

}  // namespace plumbline::programs
