// Rigid poses, and the frame notation used throughout.
//
// Frames: W world (that of the instrument; "measurement frame" in files), B robot base, F flange, T
// tool tip. X_BF is the pose of F in B; p_BQ is the position of point Q expressed in B. Adjacent
// frame letters must match in a product: X_WT = X_WB * X_BF * X_FT, p_BQ = X_BF * p_FQ.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline {

template <typename T>
using Vec3Of = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Mat3Of = Eigen::Matrix<T, 3, 3>;

using Vec3 = Vec3Of<double>;
using Mat3 = Mat3Of<double>;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Vec3f = Vec3Of<float>;

/// A rigid pose X_AB with rotation R_AB and translation p_AB [m]: p_AQ = R_AB p_BQ + p_AB. T is
/// double or a dual number for automatic differentiation.
template <typename T>
struct PoseOf {
  Mat3Of<T> R = Mat3Of<T>::Identity();
  Vec3Of<T> p = Vec3Of<T>::Zero();

  PoseOf Inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
};

using Pose = PoseOf<double>;

template <typename T>
PoseOf<T> operator*(const PoseOf<T>& X_AB, const PoseOf<T>& X_BC) {
  return {X_AB.R * X_BC.R, X_AB.R * X_BC.p + X_AB.p};
}

template <typename T>
Vec3Of<T> operator*(const PoseOf<T>& X_AB, const Vec3Of<T>& p_BQ) {
  return X_AB.R * p_BQ + X_AB.p;
}

}  // namespace plumbline
