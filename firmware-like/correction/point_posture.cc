#include "firmware-like/correction/point_posture.h"

#include <algorithm>
#include <cmath>

namespace plumbline::correction {
namespace {

double BoundOf(const kinematics::Chain& chain, int joint) {
  return chain.type(joint) == model::JointType::kPrismatic ? kTaughtBound_m : kTaughtBound_rad;
}

}  // namespace

JointDistance FarthestFromTaught(const kinematics::Chain& chain, const model::JointVector& taught,
                                 const model::JointVector& q) {
  JointDistance farthest;
  double share = -1;
  for (int i = 0; i < chain.size(); ++i) {
    const double change = std::abs(q[i] - taught[i]);
    if (change / BoundOf(chain, i) <= share) continue;
    share = change / BoundOf(chain, i);
    farthest = {i, change};
  }
  return farthest;
}

bool IsOtherPosture(const kinematics::Chain& chain, const JointDistance& farthest) {
  return farthest.joint >= 0 && farthest.distance > BoundOf(chain, farthest.joint);
}

JointDistance NearestLimit(const kinematics::Chain& chain, const model::JointVector& q) {
  JointDistance nearest;
  for (int i = 0; i < chain.size(); ++i) {
    const double distance = std::min(q[i] - chain.lower()[i], chain.upper()[i] - q[i]);
    if (!std::isfinite(distance)) continue;
    if (nearest.joint < 0 || distance < nearest.distance) nearest = {i, distance};
  }
  return nearest;
}

PointPosture PointPostureAt(const kinematics::Chain& chain, const AssemblyPoint& point,
                            const model::JointVector& q) {
  PointPosture posture;
  posture.taught = point.near_q.has_value();
  posture.differs =
      posture.taught && IsOtherPosture(chain, FarthestFromTaught(chain, *point.near_q, q));
  posture.limit = NearestLimit(chain, q);
  return posture;
}

}  // namespace plumbline::correction
