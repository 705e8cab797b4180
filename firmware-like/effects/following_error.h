// Following error: a joint that lags its command in proportion to its speed in a synchronised move.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// In a synchronised point-to-point move all joints start and arrive together, so joint i runs at a
/// fixed fraction of the leading joint's speed:
///   s_i -= value_i u_i,   u_i = dq_i / max_j |dq_j|                        [rad]
/// with dq the change of q in the last move. A position loop with gain K_v lags by qd / K_v
/// (Siciliano et al., Robotics, ch. 8). Whatever part of the lag is left when the point is measured
/// (not yet settled, or retained by static friction) is proportional to u_i. Unlike `approach_lag`
/// it does not grow with the move; unlike `backlash` by move it is smaller in a joint that turned
/// little. Valid for arms with joints of one type, moves at one programmed speed, and moves long
/// enough to reach it.
const Effect& FollowingError();

}  // namespace plumbline::effects
