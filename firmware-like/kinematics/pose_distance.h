// Distance of a pose from the nearest of a set of measured poses.
#pragma once

#include <span>
#include <vector>

#include "firmware-like/kinematics/chain.h"

namespace plumbline {

/// Root-mean-square difference of the joints, each weighted by how far it moves the tip:
///   d^2(q, p) = sum_j r_j^2 (2 sin((q_j - p_j) / 2))^2 / sum_j r_j^2
/// with r_j the tip's distance from axis j, RMS over the set [m]. A deviation that repeats once a
/// turn of each joint, of random size and phase, changes between two poses by an amount in
/// proportion to d; so do eccentric encoders, wobbling axes and gravity's pull. The chord rather
/// than the angle: half a turn away is farthest, d = 2, and a whole turn is the same pose. A
/// prismatic joint adds its travel squared to the sum above the line. For an arm that has no joint
/// to turn the tip, sum_j r_j^2 is 1 m^2.
class PoseDistance {
 public:
  /// @param tip_F  the tip in the flange frame [m]
  /// @param poses  joints [rad] or [m] of each, shape (n)
  PoseDistance(const Chain& chain, const Vec3& tip_F, std::span<const JointVector> poses);

  bool empty() const { return features_.cols() == 0; }

  /// Distance of q from the nearest pose [rad]; 0 where the set is empty. Allocates nothing; costs
  /// about a nanosecond per pose and joint.
  double Of(const JointVector& q) const;

  /// Points whose Euclidean distance is d, a column for each pose of the set.
  const Eigen::MatrixXd& features() const { return features_; }

 private:
  using Feature = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2 * kMaxJoints>;

  Feature FeatureOf(const JointVector& q) const;

  std::vector<JointType> types_;
  JointVector weights_;  ///< r_j over the root of their sum of squares; of a prismatic joint [1/m]
  Eigen::MatrixXd features_;
};

}  // namespace plumbline
