// Base tilt: the base rotates by a factor times the reading of its inclinometer.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The base rotates about its origin by value times the inclinometer reading, columns tilt_x_deg
/// and tilt_y_deg: rotations about x and y of W. Unit: 1; the value is 1 if the base rotates
/// exactly by the reading. Gravity keeps its direction in W. Valid for rotations of milliradians.
/// Adds nothing if the columns are missing.
const Effect& BaseTilt();

}  // namespace plumbline::effects
