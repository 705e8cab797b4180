#include "app/measure/urdf/chain_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/statistics/random_sequence.h"

namespace plumbline::measure {

void ChainDifference::Add(const Pose& a, const Pose& b) {
  distance_m = std::max(distance_m, (a.p - b.p).norm());
  angle_rad = std::max(angle_rad, VectorFromRotation(a.R.transpose() * b.R).norm());
}

std::vector<model::JointVector> RandomPostures(const model::Robot& robot, int count) {
  statistics::RandomSequence random(1);
  std::vector<model::JointVector> postures;
  for (int k = 0; k < count; ++k) {
    model::JointVector& q = postures.emplace_back(robot.size());
    for (int i = 0; i < robot.size(); ++i) {
      const model::Joint& joint = robot.joints[i];
      const double free = joint.type == model::JointType::kRevolute ? std::numbers::pi : 1;
      const double low = std::isfinite(joint.min) ? joint.min : -free;
      const double high = std::isfinite(joint.max) ? joint.max : free;
      q[i] = low + (std::max(low, high) - low) * random.Uniform();
    }
  }
  return postures;
}

ChainDifference DifferenceOf(const JointChain& chain, const model::Robot& robot,
                             const std::vector<model::JointVector>& postures) {
  const kinematics::Chain table(robot);
  ChainDifference difference;
  kinematics::Posture posture;
  for (const model::JointVector& q : postures) {
    table.Evaluate(q, posture);
    difference.Add(TipPose(chain, table.AxisPositions<double>(q)), robot.X_WB * posture.X_BF());
  }
  return difference;
}

}  // namespace plumbline::measure
