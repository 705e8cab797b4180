// Gravity direction: a measurement frame that is not level.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Gravity rotates about the axes of the measurement frame by the rotation vector (x, y, 0)
/// [formats.md]. Unit: rad. The instrument, or the frame built from its reference marks, was not
/// levelled; only loads change, not the geometry.
const Effect& GravityDirection();

}  // namespace plumbline::effects
