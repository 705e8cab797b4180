// Axis coupling: a joint that turns along with a joint inboard of it.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The drive of an outer axis runs through the inner ones: bevel gears of a wrist, hollow shafts, a
/// parallelogram. If the controller's decoupling ratio is wrong by the value, joint i turns with
/// q_j, j < i:
///   s_i += value_ij q_j            [1], named q<i>_of_q<j>
/// [Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, on remotely driven links]. Zero if
/// every inner joint is at its controller zero. If q_j hardly varies, equivalent to joint_offset.
const Effect& AxisCoupling();

}  // namespace plumbline::effects
