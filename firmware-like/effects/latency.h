// Joints and measurement that are not of the same moment.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i -= time qd_i, all joints alike   [formats.md]: the arm is where it was `time` ago. Unit: s.
/// Nothing where velocities are unknown. Valid while qd hardly changes within `time`.
const Effect& Latency();

}  // namespace plumbline
