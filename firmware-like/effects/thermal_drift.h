// Thermal drift: a base or instrument that drifts while the cell warms up.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The base moves by (x, y, z) (1 - exp(-t / time_constant)) in W, with t the time of the row [s].
/// File units: mm, s. Adds nothing without a time constant, or if the time is unknown. Valid for
/// one warm-up that started at t = 0.
const Effect& ThermalDrift();

}  // namespace plumbline::effects
