// A joint that turns a little more, or less, than it was told.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i += value_i q_i, q_i as commanded [rad]. Unit: 1. A gearbox's ratio is a ratio of teeth, so
/// what is found is a wrong entry in the controller, or an encoder's scale; 5e-3 is generous.
const Effect& GearRatio();

}  // namespace plumbline
