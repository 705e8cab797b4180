// Incomplete approach: a joint that is measured before it has fully arrived.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i -= value_i (last move of joint i)   [formats.md]. Unit: 1, the fraction of the move that
/// remains. Valid if the waiting time after each move is the same.
const Effect& ApproachLag();

}  // namespace plumbline::effects
