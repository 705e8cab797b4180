// Joints that get stiffer as their torque grows.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i -= value_i tau_i^3, beside the linear compliance   [strain-wave gears: Tuttle 1992, MIT
/// AI-TR 1365]. Unit: rad/(N m)^3. Valid while value tau^2 stays below a third of the compliance:
/// beyond that the joint would turn back under a growing load.
const Effect& JointHardening();

}  // namespace plumbline
