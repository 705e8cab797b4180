// Latency: joints and measurement that were not sampled at the same time.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i -= time qd_i, the same time for all joints   [formats.md]: the measurement shows the arm
/// where it was `time` ago. Unit: s. Adds nothing if velocities are unknown. Valid if qd hardly
/// changes within `time`.
const Effect& Latency();

}  // namespace plumbline::effects
