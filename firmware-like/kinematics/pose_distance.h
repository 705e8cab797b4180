// Distance of a posture from the nearest of a set of measured postures.
#pragma once

#include <span>
#include <vector>

#include "firmware-like/kinematics/chain.h"

namespace plumbline::kinematics {

/// How far a joint is beyond a range [rad] or [m].
/// @param turns  a whole turn is the same posture, see Chain::RepeatsAfterTurn()
double DistanceBeyond(const model::Interval& range, double q, bool turns);

/// Root-mean-square joint difference, each joint weighted by how far it moves the tip:
///   d^2(q, p) = sum_j r_j^2 (2 sin((a_j - b_j) / 2))^2 / sum_j r_j^2
/// with a and b the positions of the axes at q and p, and r_j the distance of the tip from axis j,
/// RMS over the set [m]. An error that repeats once per turn of each joint, with random amplitude
/// and phase, changes between two postures in proportion to d; eccentric encoders, wobbling axes
/// and gravity behave like this. The chord is used instead of the angle because half a turn is the
/// largest distance (d = 2) and a whole turn is the same posture. A prismatic joint adds its
/// squared travel to the numerator. If no joint rotates the tip, sum_j r_j^2 is 1 m^2.
class PoseDistance {
 public:
  /// @param tip_F  tip in the flange frame [m]
  /// @param poses  measured postures [rad] or [m], each of shape (n)
  PoseDistance(const Chain& chain, const Vec3& tip_F, std::span<const model::JointVector> poses);

  bool empty() const { return features_.cols() == 0; }
  /// r_j / sqrt(sum of squares); of a prismatic joint [1/m].
  double weight(int joint) const { return weights_[joint]; }

  /// The same over the largest of all joints, 0..1: how far the joint moves the tip.
  double lever(int joint) const {
    const double largest = weights_.maxCoeff();
    return largest > 0 ? weights_[joint] / largest : 0;
  }

  /// Distance of q from the nearest posture of the set [rad]; 0 if the set is empty. Does not
  /// allocate; takes about a nanosecond per posture and joint.
  double Of(const model::JointVector& q) const;

  /// Feature vectors whose Euclidean distance is d, one column per posture of the set.
  const Eigen::MatrixXd& features() const { return features_; }

 private:
  using Feature = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2 * model::kMaxJoints>;

  Feature FeatureOf(const model::JointVector& q) const;

  std::vector<model::JointType> types_;
  std::vector<model::JointCoupling> couplings_;
  model::JointVector weights_;  ///< r_j / sqrt(sum of squares); of a prismatic joint [1/m]
  Eigen::MatrixXd features_;
};

}  // namespace plumbline::kinematics
