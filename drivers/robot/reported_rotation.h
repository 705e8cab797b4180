// Rotation matrix of the three angles that a controller reports.
#pragma once

#include "drivers/robot/profile.h"

namespace plumbline::robot {

/// @param angles  in the order of the convention [rad]
inline Mat3 RotationFromReported(const Vec3& angles, ReportedOrientation convention) {
  switch (convention) {
    case ReportedOrientation::kRotationVector:
      return RotationFromVector(angles);
    case ReportedOrientation::kRollPitchYaw:
      return RotationFromRollPitchYaw(angles);
    case ReportedOrientation::kAbc:
      return RotationFromRollPitchYaw(angles.reverse());
    case ReportedOrientation::kZyz:
      break;
  }
  return (Eigen::AngleAxisd(angles[0], Vec3::UnitZ()) *
          Eigen::AngleAxisd(angles[1], Vec3::UnitY()) * Eigen::AngleAxisd(angles[2], Vec3::UnitZ()))
      .toRotationMatrix();
}

}  // namespace plumbline::robot
