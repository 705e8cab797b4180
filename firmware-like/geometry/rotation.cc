#include "firmware-like/geometry/rotation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace plumbline {
namespace {

/// The quaternion of R with w >= 0.
Eigen::Quaterniond QuaternionOf(const Mat3& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

}  // namespace

Mat3 RotationFromVector(const Vec3& v) {
  const double angle = v.norm();
  Mat3 K;
  K << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  if (angle < 1e-4) {
    const double a2 = angle * angle;
    return Mat3::Identity() + (1 - a2 / 6) * K + (0.5 - a2 / 24) * K * K;
  }
  const double half_sine = std::sin(0.5 * angle);
  return Mat3::Identity() + std::sin(angle) / angle * K +
         2 * half_sine * half_sine / (angle * angle) * K * K;
}

Vec3 VectorFromRotation(const Mat3& R) {
  const Eigen::Quaterniond q = QuaternionOf(R);
  const double sine = q.vec().norm();  // of the half angle
  if (sine < 1e-9) return 2 * q.vec();
  return 2 * std::atan2(sine, q.w()) / sine * q.vec();
}

Mat3 RotationFromRollPitchYaw(const Vec3& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Vec3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vec3::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Vec3::UnitX()))
      .toRotationMatrix();
}

Vec3 RollPitchYawFromRotation(const Mat3& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), cos_pitch);
  const double roll = cos_pitch < 1e-13 ? 0 : std::atan2(R(2, 1), R(2, 2));
  // The second column of Rz(yaw) Ry(pitch) = R Rx(-roll) does not depend on the pitch.
  const Vec3 y = std::cos(roll) * R.col(1) - std::sin(roll) * R.col(2);
  return {roll, pitch, std::atan2(-y.x(), y.y())};
}

double QuaternionScalar(const Mat3& R) {
  return QuaternionOf(R).w();
}

Vec3 AnglesFromRotation(const Mat3& R, OrientationConvention convention) {
  if (convention == OrientationConvention::kQuaternion) return QuaternionOf(R).vec();
  if (convention == OrientationConvention::kRotationVector) return VectorFromRotation(R);
  const Vec3 rpy = RollPitchYawFromRotation(R);
  return convention == OrientationConvention::kRollPitchYaw ? rpy : Vec3(rpy.reverse());
}

Mat3 RotationFromAngles(const Vec3& angles, OrientationConvention convention) {
  if (convention == OrientationConvention::kQuaternion) {
    const double w = std::sqrt(std::max(0.0, 1 - angles.squaredNorm()));
    return Eigen::Quaterniond(w, angles.x(), angles.y(), angles.z()).normalized().matrix();
  }
  if (convention == OrientationConvention::kRotationVector) return RotationFromVector(angles);
  return RotationFromRollPitchYaw(
      convention == OrientationConvention::kRollPitchYaw ? angles : Vec3(angles.reverse()));
}

Mat3 NearestRotation(const Mat3& M, double* smallest_singular_value) {
  const Eigen::JacobiSVD<Mat3> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (smallest_singular_value) *smallest_singular_value = svd.singularValues()[2];
  Mat3 U = svd.matrixU();
  if ((U * svd.matrixV().transpose()).determinant() < 0) U.col(2) *= -1;
  return U * svd.matrixV().transpose();
}

Mat3 RotationOfZOnto(const Vec3& direction) {
  const Vec3 d = direction.normalized();
  const double sin2 = d.head<2>().squaredNorm();
  if (d.z() < 0 && sin2 < 1e-30) return Vec3(1, -1, -1).asDiagonal();
  // Rodrigues: I + [v]x + [v]x^2 / (1 + cos), with v = z x d; 1 + cos without cancellation near -z.
  const Mat3 cross = CrossMatrix(Vec3(-d.y(), d.x(), 0));
  return Mat3::Identity() + cross + cross * cross / (d.z() < 0 ? sin2 / (1 - d.z()) : 1 + d.z());
}

}  // namespace plumbline
