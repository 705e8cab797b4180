// Rotations between matrices and the three-number conventions of controllers and files.
#pragma once

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// How three angles stand for an orientation at the edge of the program.
enum class OrientationConvention {
  kRotationVector = 0,  ///< axis times angle [rad] (Universal Robots)
  kRollPitchYaw = 1,    ///< (roll, pitch, yaw): R = Rz(yaw) Ry(pitch) Rx(roll) (xArm, cell.toml)
  kAbc = 2,             ///< (A, B, C): R = Rz(A) Ry(B) Rx(C) (KUKA)
};

/// [v]x: [v]x a is the cross product of v and a.
inline Mat3 CrossMatrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// R = exp([v]x), v a rotation vector [rad]. Exact for every length, series near zero.
Mat3 RotationFromVector(const Vec3& v);

/// The rotation vector of R with length 0..pi [rad]; the inverse of RotationFromVector.
/// Well conditioned at both ends (through the quaternion).
Vec3 VectorFromRotation(const Mat3& R);

/// R = Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]); rpy in rad.
Mat3 RotationFromRollPitchYaw(const Vec3& rpy);

/// (roll, pitch, yaw) [rad] of R, pitch in -pi/2..pi/2; at the pole roll is set to 0.
Vec3 RollPitchYawFromRotation(const Mat3& R);

/// The three angles of R in a convention [rad], in the order in which the convention names them.
Vec3 AnglesFromRotation(const Mat3& R, OrientationConvention convention);

/// The rotation that three angles [rad] stand for in a convention.
Mat3 RotationFromAngles(const Vec3& angles, OrientationConvention convention);

}  // namespace plumbline
