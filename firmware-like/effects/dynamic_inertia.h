// Dynamic deflection: a joint that lags while it is accelerated.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i -= value_i qdd_i, value_i = compliance times inertia = 1 / (natural frequency)^2
/// [formats.md; Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit: s^2. Adds nothing if
/// accelerations are unknown. Valid far below the joint's natural frequency and for a nearly
/// constant inertia.
const Effect& DynamicInertia();

}  // namespace plumbline::effects
