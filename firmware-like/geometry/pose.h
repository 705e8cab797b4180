// Rigid poses and the frames of a cell.
//
// Frames: W world (the instrument's, "measurement frame" in the files), B robot base, F flange,
// T tool tip. X_BF is the pose of F in B; p_BQ is the position of Q, measured in B. A product
// checks by eye: X_WT = X_WB * X_BF * X_FT, p_BQ = X_BF * p_FQ.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// A rigid pose X_AB: R_AB and p_AB [m], so that p_AQ = R_AB p_BQ + p_AB.
struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();

  Pose Inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
};

inline Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.R * X_BC.R, X_AB.R * X_BC.p + X_AB.p};
}

inline Vec3 operator*(const Pose& X_AB, const Vec3& p_BQ) {
  return X_AB.R * p_BQ + X_AB.p;
}

}  // namespace plumbline
