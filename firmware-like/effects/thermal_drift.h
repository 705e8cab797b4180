// A base or an instrument that creeps away while the cell warms up.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The base moves by (x, y, z) (1 - exp(-t / time_constant)) in W, t the time of the row [s]. Units
/// of the files: mm, s. Nothing before a time constant is given, or where the time is unknown.
/// Valid for one warm-up that began at t = 0.
const Effect& ThermalDrift();

}  // namespace plumbline
