// Postures of the arm in which the programmed pose is reached.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/correction/correct.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

/// A tool point and where it shall be, without load.
struct ArmTarget {
  Pose X_BP;                 ///< of the tool point, with the orientation of the tip T
  Vec3 p_TP = Vec3::Zero();  ///< the tool point in the tip's frame [m]
  int tool = 0;
};

/// Joints that bring the unloaded tool point to a target, by Newton's method from a seed, in the
/// turn within the limits nearest to the seed; nullopt if it leads nowhere.
std::optional<model::JointVector> PostureNear(const correction::Corrector& corrector,
                                              const ArmTarget& target,
                                              const model::JointVector& seed);

/// All postures that reach a target within the joint limits, whole turns of the joints included;
/// joints without limits are given within one turn of zero. Searches from a fixed sequence of
/// starts and from the mirror images of what they find, about a millisecond.
std::vector<model::JointVector> PosturesOf(const correction::Corrector& corrector,
                                           const ArmTarget& target);

/// The posture in which a motion reaches its target.
/// @param agrees  whether a posture agrees with what the point states
/// @param states  the point states a posture
/// @param seed    joints near which the motion ends: those that the file states, or those of the
///                previous motion
/// @return        the nearest to the seed that agrees. Without a seed, the only one that agrees, in
///                the turns nearest to zero; else why there is none, or none that can be chosen
Result<model::JointVector> ChosenPosture(
    const correction::Corrector& corrector, const ArmTarget& target,
    const std::function<bool(const model::JointVector&)>& agrees, bool states,
    const std::optional<model::JointVector>& seed);

}  // namespace plumbline::programs
