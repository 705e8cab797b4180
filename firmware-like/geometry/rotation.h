// Conversions between rotation matrices and the orientation conventions of controllers.
#pragma once

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// Orientation conventions of robot controllers and files.
enum class OrientationConvention {
  kRotationVector = 0,  ///< axis times angle [rad] (Universal Robots)
  kRollPitchYaw = 1,    ///< (roll, pitch, yaw): R = Rz(yaw) Ry(pitch) Rx(roll) (xArm, cell.toml)
  kAbc = 2,             ///< (A, B, C): R = Rz(A) Ry(B) Rx(C) (KUKA)
  kQuaternion = 3,  ///< (x, y, z) of the unit quaternion whose w is not negative (ABB); not angles
};

/// Cross-product matrix [v]x: [v]x a = v x a.
inline Mat3 CrossMatrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// R = exp([v]x) for a rotation vector v [rad] of any length; uses a series near zero.
Mat3 RotationFromVector(const Vec3& v);

/// Rotation vector of R, with length 0..pi [rad]; inverse of RotationFromVector. Computed via the
/// quaternion, so it is well conditioned near 0 and near pi.
Vec3 VectorFromRotation(const Mat3& R);

/// R = Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]); rpy in rad.
Mat3 RotationFromRollPitchYaw(const Vec3& rpy);

/// (roll, pitch, yaw) of R [rad], with pitch in -pi/2..pi/2; roll is set to 0 at gimbal lock.
Vec3 RollPitchYawFromRotation(const Mat3& R);

/// The three angles of R in a convention [rad], in the order that the convention defines; with
/// kQuaternion, the vector part.
Vec3 AnglesFromRotation(const Mat3& R, OrientationConvention convention);

/// The scalar part w of the quaternion of R, 0..1, that belongs to the vector part above.
double QuaternionScalar(const Mat3& R);

/// Rotation matrix of three angles [rad] in a convention. A vector part longer than 1 is shortened.
Mat3 RotationFromAngles(const Vec3& angles, OrientationConvention convention);

/// The rotation R that maximises trace(R^T M), and minimises |R - M| (Frobenius): with M = U S V^T,
/// R = U diag(1, 1, det(U V^T)) V^T (Kabsch 1976). M must be finite. R is unique unless the two
/// smallest singular values are 0, or equal with det(M) < 0.
/// @param smallest_singular_value  if not null, the smallest of M; 1 if M is a rotation
Mat3 NearestRotation(const Mat3& M, double* smallest_singular_value = nullptr);

/// The smallest rotation that takes the z axis to a direction of any length above 0; a half turn
/// about x where that is -z.
Mat3 RotationOfZOnto(const Vec3& direction);

}  // namespace plumbline
