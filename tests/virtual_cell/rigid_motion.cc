#include "tests/virtual_cell/rigid_motion.h"

#include <cmath>
#include <numbers>

namespace virtual_cell {

Motion Exponential(const Screw& screw, double amount) {
  Motion X = Motion::Identity();
  if (screw.omega.isZero()) {
    X.translation() = screw.v * amount;
    return X;
  }
  const Mat3 R = RotationFromVector(screw.omega * amount);
  X.linear() = R;
  X.translation() = (Mat3::Identity() - R) * screw.omega.cross(screw.v) +
                    screw.omega * (screw.omega.dot(screw.v) * amount);
  return X;
}

Screw Transported(const Motion& X, const Screw& screw) {
  const Vec3 omega = X.linear() * screw.omega;
  return {omega, X.linear() * screw.v + X.translation().cross(omega)};
}

Mat3 RotationFromVector(const Vec3& r) {
  const double angle = r.norm();
  if (angle == 0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

Vec3 VectorFromRotation(const Mat3& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * q.vec();
  return q.vec() * (2 * std::atan2(sine, q.w()) / sine);
}

Motion MotionFromXyzMmRpyDeg(const Vec3& xyz_mm, const Vec3& rpy_deg) {
  Motion X = Motion::Identity();
  X.linear() = RotationFromVector(Vec3::UnitZ() * RadFromDeg(rpy_deg.z())) *
               RotationFromVector(Vec3::UnitY() * RadFromDeg(rpy_deg.y())) *
               RotationFromVector(Vec3::UnitX() * RadFromDeg(rpy_deg.x()));
  X.translation() = xyz_mm * 1e-3;
  return X;
}

Motion MotionFromXyzVector(const Vec3& xyz_m, const Vec3& rotation_vector_rad) {
  Motion X = Motion::Identity();
  X.linear() = RotationFromVector(rotation_vector_rad);
  X.translation() = xyz_m;
  return X;
}

double RadFromDeg(double deg) {
  return deg * std::numbers::pi / 180;
}
double DegFromRad(double rad) {
  return rad * 180 / std::numbers::pi;
}

}  // namespace virtual_cell
