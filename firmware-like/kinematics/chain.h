// Forward kinematics of a serial arm: the frames, axes and Jacobian of one posture.
#pragma once

#include <array>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// 6 x n: rows 0-2 velocity of a point [m/rad], rows 3-5 angular velocity [rad/rad], in B.
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxJoints>;

/// Frames of an arm in one posture, all in B.
struct Posture {
  int size = 0;
  std::array<Pose, kMaxJoints> X_BL;     ///< frame after joint i ("that joint's DH frame")
  std::array<Vec3, kMaxJoints> axis_B;   ///< positive direction of joint i's own count
  std::array<Vec3, kMaxJoints> point_B;  ///< a point on that axis [m]

  /// The flange F: the frame after the last joint.
  const Pose& X_BF() const { return X_BL[static_cast<std::size_t>(size - 1)]; }
};

/// A serial arm by Denavit-Hartenberg parameters.
///   dh  (distal):   T_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)      [Denavit & Hartenberg 1955]
///   mdh (proximal): T_i = Rx(alpha_i) Tx(a_i) Rz(theta_i) Tz(d_i)      [Craig, ch. 3]
/// with theta_i = sign_i q_i + offset_i (revolute) or d_i = sign_i q_i + d_i (prismatic). The joint
/// deflection s is part of q here: pass q + s for the sagged arm.
class Chain {
 public:
  /// @param robot  1..kMaxJoints joints; the configuration reader has checked it
  explicit Chain(const Robot& robot);

  int size() const { return size_; }
  JointType type(int joint) const { return links_[static_cast<std::size_t>(joint)].type; }
  const JointVector& lower() const { return lower_; }  ///< joint limits [rad] or [m]
  const JointVector& upper() const { return upper_; }
  bool WithinLimits(const JointVector& q, double margin = 0) const;

  /// Largest distance from B's origin that the flange can have [m]; an upper bound.
  double Reach() const { return reach_m_; }

  /// Frames at joint positions q [rad] or [m], shape (n). Allocates nothing.
  void Evaluate(const JointVector& q, Posture& posture) const;

  /// Columns of a point p_BQ [m] that moves with the flange.
  void JacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const;

 private:
  struct Link {
    JointType type;
    double a, d, offset, sign, cos_alpha, sin_alpha;
  };

  DhConvention convention_;
  int size_;
  std::array<Link, kMaxJoints> links_;
  JointVector lower_, upper_;
  double reach_m_ = 0;
};

}  // namespace plumbline
