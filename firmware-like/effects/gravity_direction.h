// Gravity that is not where the measurement frame says.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// Gravity turns about the measurement axes by the rotation vector (x, y, 0)   [formats.md]. Unit:
/// rad. The instrument, or the frame built from its marks, was not levelled; geometry stays, only
/// loads change.
const Effect& GravityDirection();

}  // namespace plumbline
