// On which side of their limits the shoulder and the elbow of a six-axis arm are.
#pragma once

#include <optional>

#include "firmware-like/kinematics/chain.h"

namespace plumbline::programs {

/// Relative to the reach, and positive as with all joints at 0, where the upper arm of FANUC and
/// Yaskawa arms is upright and the forearm level; about 0 at the limit.
struct ArmSides {
  double elbow_up = 0;  ///< the direction in which the elbow bends
  double front = 0;     ///< the wrist's distance in front of the first axis
};

/// nullopt for arms without six joints.
std::optional<ArmSides> ArmSidesOf(const kinematics::Chain& chain, const model::JointVector& q);

}  // namespace plumbline::programs
