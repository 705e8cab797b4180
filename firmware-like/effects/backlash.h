// Backlash: play in a gearbox, taken up by gravity or by the last move.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// value_i is half the gap [rad]   [formats.md; Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. `by` states what holds the joint at one flank:
///   load  s_i += value_i sign(tau_i)
///   move  s_i += value_i sign(last nonzero move of joint i); nothing before the first one
/// As long as that sign does not change, equivalent to joint_offset. Not valid for torques near
/// zero, where the joint may lie anywhere in its gap.
const Effect& Backlash();

}  // namespace plumbline::effects
