// Joints that lag behind while they are accelerated.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i -= value_i qdd_i, value_i = compliance times inertia = 1 / (natural frequency)^2
/// [formats.md; Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit: s^2. Nothing where
/// accelerations are unknown. Valid far below the joint's natural frequency, with an inertia that
/// hardly changes.
const Effect& DynamicInertia();

}  // namespace plumbline
