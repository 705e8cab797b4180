#include "firmware-like/kinematics/pose_distance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::kinematics {
namespace {

/// Squared distance of the tip from each revolute axis, summed over the postures [m^2].
model::JointVector SquaredLevers(const Chain& chain, const Vec3& tip_F,
                                 std::span<const model::JointVector> poses) {
  model::JointVector squares = model::JointVector::Zero(chain.size());
  Posture posture;
  Jacobian jacobian;
  for (const model::JointVector& q : poses) {
    chain.Evaluate(q, posture);
    chain.AxisJacobianAt(posture, posture.X_BF() * tip_F, jacobian);
    for (int j = 0; j < chain.size(); ++j) {
      if (chain.type(j) == model::JointType::kRevolute)
        squares[j] += jacobian.col(j).head<3>().squaredNorm();
    }
  }
  return squares;
}

}  // namespace

double DistanceBeyond(const model::Interval& range, double q, bool turns) {
  double distance = range.DistanceOf(q);
  for (const double turn : {-2 * std::numbers::pi, 2 * std::numbers::pi}) {
    if (turns) distance = std::min(distance, range.DistanceOf(q + turn));
  }
  return distance;
}

PoseDistance::PoseDistance(const Chain& chain, const Vec3& tip_F,
                           std::span<const model::JointVector> poses)
    : couplings_(chain.couplings()),
      weights_(chain.size()),
      features_(2 * chain.size(), static_cast<Eigen::Index>(poses.size())) {
  const model::JointVector squares = SquaredLevers(chain, tip_F, poses);
  const double count = std::max(1.0, static_cast<double>(poses.size()));
  const double sum_m2 = squares.sum() > 0 ? squares.sum() / count : 1;
  for (int j = 0; j < chain.size(); ++j) {
    types_.push_back(chain.type(j));
    const bool turns = types_.back() == model::JointType::kRevolute;
    weights_[j] = std::sqrt((turns ? squares[j] / count : 1) / sum_m2);
  }
  for (std::size_t k = 0; k < poses.size(); ++k) {
    features_.col(static_cast<Eigen::Index>(k)) = FeatureOf(poses[k]);
  }
}

PoseDistance::Feature PoseDistance::FeatureOf(const model::JointVector& q) const {
  const model::JointVector axes = model::AxisPositions<double>(couplings_, q);
  Feature feature(2 * q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const bool turns = types_[j] == model::JointType::kRevolute;
    feature[2 * j] = weights_[j] * (turns ? std::cos(axes[j]) : axes[j]);
    feature[2 * j + 1] = turns ? weights_[j] * std::sin(axes[j]) : 0;
  }
  return feature;
}

double PoseDistance::Of(const model::JointVector& q) const {
  if (empty()) return 0;
  const Feature feature = FeatureOf(q);
  return std::sqrt((features_.colwise() - feature).colwise().squaredNorm().minCoeff());
}

}  // namespace plumbline::kinematics
