// Joint hardening: a joint that becomes stiffer as its torque grows.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i -= value_i tau_i^3, in addition to the linear compliance   [strain-wave gears: Tuttle 1992,
/// MIT AI-TR 1365]. Unit: rad/(N m)^3. Valid while value tau^2 is below a third of the compliance;
/// beyond that, the deflection would decrease under a growing load.
const Effect& JointHardening();

}  // namespace plumbline::effects
