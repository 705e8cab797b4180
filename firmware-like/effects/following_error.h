// A joint that is measured behind its command by its speed in a synchronised move.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// In a synchronised point-to-point move all joints start and arrive together, so that joint i runs
/// at its share of the leading joint's speed:
///   s_i -= value_i u_i,   u_i = dq_i / max_j |dq_j|                        [rad]
/// with dq the change of q in the last move. A position loop of gain K_v follows qd / K_v behind
/// (Siciliano et al., Robotics, ch. 8); what is left of it when the point is measured, or what
/// static friction holds on arrival, keeps that share. Unlike `approach_lag` it does not grow with
/// the move, unlike `backlash` by move it is smaller in a joint that turned little. Valid for arms
/// whose joints are all of one kind and moves at one programmed speed; long enough to reach it.
const Effect& FollowingError();

}  // namespace plumbline
