// Play in a gearbox that gravity, or the last move, takes up.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// value_i is half the gap [rad]   [formats.md; Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. `by` says what holds the joint at one flank:
///   load  s_i += value_i sign(tau_i)
///   move  s_i += value_i sign(last move of joint i that was not zero); nothing before the first
/// While that sign never changes, this equals joint_offset. Not valid where the torque is near
/// zero: the joint then lies anywhere in its gap.
const Effect& Backlash();

}  // namespace plumbline
