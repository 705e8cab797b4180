// Gear ratio error: a joint that turns by a constant fraction more or less than commanded.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i += value_i q_i, with the commanded q_i [rad]. Unit: 1. The true ratio is fixed by the tooth
/// counts, so a nonzero value indicates a wrong entry in the controller or a scale error of the
/// encoder; 5e-3 is a generous limit.
const Effect& GearRatio();

}  // namespace plumbline::effects
