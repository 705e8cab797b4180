// How the posture chosen for a point compares with the one it was taught in, and its joint margins.
#pragma once

#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline {

/// From here on a posture is another one than the one that was taught [rad]. Deflection, a point
/// that was moved by centimetres and a worn pendant reading change a joint by a few degrees.
/// Another branch changes some axis by far more: a flipped wrist turns two axes by 180 degrees, the
/// arm turned about axis 1 by 180, and a flipped elbow by twice its bend, which is below 30 degrees
/// only within 15 degrees of the stretched arm, where the smallest singular value speaks.
inline constexpr double kTaughtBound_rad = 30 * kRadPerDeg;
/// The same of a prismatic joint [m]: its branches are those of a redundant arm.
inline constexpr double kTaughtBound_m = 0.1;

/// A joint and how far it is from something [rad], or [m] where it is prismatic.
struct JointDistance {
  int joint = -1;  ///< from 0; -1: none
  double distance = 0;
};

/// The joint whose change from `taught` to `q` is the largest share of its bound.
JointDistance FarthestFromTaught(const Chain& chain, const JointVector& taught,
                                 const JointVector& q);

/// True where that change is beyond the joint's bound.
bool IsOtherPosture(const Chain& chain, const JointDistance& farthest);

/// The joint nearest to one of its limits, radians and metres alike; negative beyond the limit.
/// None where no joint has limits.
JointDistance NearestLimit(const Chain& chain, const JointVector& q);

/// What is said of the posture of a configured point.
struct PointPosture {
  bool taught = false;   ///< the point names the joints where it was taught
  bool differs = false;  ///< the posture chosen is another one
  JointDistance limit;   ///< NearestLimit
};

/// @param q  joints that are commanded
PointPosture PointPostureAt(const Chain& chain, const AssemblyPoint& point, const JointVector& q);

}  // namespace plumbline
