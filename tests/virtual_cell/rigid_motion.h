// Rigid motions as screws and their exponentials.
#pragma once

#include <Eigen/Dense>

namespace virtual_cell {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Motion = Eigen::Isometry3d;
using Joints = Eigen::VectorXd;

/// A unit screw: a rotation axis (`omega` of length 1, v = -omega x point) or, with
/// omega = 0, a translation along v.
struct Screw {
  Vec3 omega = Vec3::Zero();
  Vec3 v = Vec3::Zero();
};

/// The motion along a screw by `amount` (rad, or m where omega is zero); Rodrigues' formula,
///   R = exp([omega] amount),  p = (1 - R)(omega x v) + omega omega' v amount.
Motion Exponential(const Screw& screw, double amount);

/// The screw transformed by the motion X (adjoint action).
Screw Transported(const Motion& X, const Screw& screw);

/// Rotation by |r| about r [rad], and back with |r| <= pi.
Mat3 RotationFromVector(const Vec3& r);
Vec3 VectorFromRotation(const Mat3& R);

/// R = Rz(yaw) Ry(pitch) Rx(roll), millimetres and degrees as in the cell files.
Motion MotionFromXyzMmRpyDeg(const Vec3& xyz_mm, const Vec3& rpy_deg);
Motion MotionFromXyzVector(const Vec3& xyz_m, const Vec3& rotation_vector_rad);

double RadFromDeg(double deg);
double DegFromRad(double rad);

}  // namespace virtual_cell
