// Comparison of the posture selected for a point with its taught posture and with the joint limits.
#pragma once

#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::correction {

/// A posture differs from the taught one if a revolute joint differs by more than this [rad].
/// Deflection, a point moved by centimetres and an imprecise pendant reading change a joint by a
/// few degrees. On another branch, at least one axis changes far more: a flipped wrist turns two
/// axes by 180 degrees, an arm that reaches backwards turns axis 1 by 180 degrees, and a flipped
/// elbow turns by twice its angle. That is less than 30 degrees only within 15 degrees of the
/// stretched arm, where the singularity check applies.
inline constexpr double kTaughtBound_rad = 30 * kRadPerDeg;
/// The same for a prismatic joint [m]; its position differs between branches only if the arm is
/// redundant.
inline constexpr double kTaughtBound_m = 0.1;

/// A joint and a distance [rad], or [m] for a prismatic joint.
struct JointDistance {
  int joint = -1;  ///< 0-based; -1: none
  double distance = 0;
};

/// The joint whose change from `taught` to `q` is largest relative to its bound.
JointDistance FarthestFromTaught(const kinematics::Chain& chain, const model::JointVector& taught,
                                 const model::JointVector& q);

/// True if that change exceeds the bound of the joint.
bool IsOtherPosture(const kinematics::Chain& chain, const JointDistance& farthest);

/// The joint nearest to one of its limits, radians and metres treated alike; the distance is
/// negative beyond the limit. `joint` is -1 if no joint has limits.
JointDistance NearestLimit(const kinematics::Chain& chain, const model::JointVector& q);

/// Assessment of the posture selected for a configured point.
struct PointPosture {
  bool taught = false;   ///< the point has taught joints
  bool differs = false;  ///< the selected posture differs from the taught one
  JointDistance limit;   ///< see NearestLimit()
};

/// @param q  commanded joints [rad] or [m]
PointPosture PointPostureAt(const kinematics::Chain& chain, const AssemblyPoint& point,
                            const model::JointVector& q);

}  // namespace plumbline::correction
