// A joint that turns along with another one inwards of it.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The drive of an outer axis runs through the inner ones: bevel gears of a wrist, hollow shafts, a
/// parallelogram. Where the controller's decoupling ratio is off by the value, joint i turns with
/// q_j, j < i:
///   s_i += value_ij q_j            [1], named q<i>_of_q<j>
/// (Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, on remotely driven links). Zero
/// where every inner joint stands at its zero, as the controller counts. Where q_j hardly varies it
/// equals joint_offset.
const Effect& AxisCoupling();

}  // namespace plumbline
