// The posture that a CONFIG string of FANUC names: 'N U T, 0, 0, 0'.
#pragma once

#include <string>
#include <string_view>

#include "firmware-like/kinematics/chain.h"

namespace plumbline::programs::fanuc {

/// Whether a posture agrees with a CONFIG string; true for a string or an arm that is not
/// understood (other than six joints).
///
///   F, N  flip, no flip: J5 positive, negative. Real controllers: 'N U T' at J5 = -89.38 deg
///   U, D  elbow up, down: it bends as with all joints at 0, where the upper arm is upright and the
///         forearm level, or the other way; so real points behind the robot are 'U B'
///   T, B  front, back: the wrist is on the side of J1's axis where it is with all joints at 0
///   three numbers: whole turns of J1, J4 and J6, 0 for -180..180 deg [onerobotics.com, "The perils
///         of six-axis robots": the joints depend on the arm]. In real programs the second one is
///         1 or -1 where J5 has no such range, but J4; J4, J5, J6 are accepted, too
///
/// At a limit between two letters both agree.
/// @param with_turns  false for a linear motion, which keeps the turns that it starts with
bool ConfigAgrees(std::string_view config, const kinematics::Chain& chain,
                  const model::JointVector& q, bool with_turns);

/// The string for a posture, in the form of `config` and equal to it if it agrees.
std::string ConfigFor(std::string_view config, const kinematics::Chain& chain,
                      const model::JointVector& q);

}  // namespace plumbline::programs::fanuc
