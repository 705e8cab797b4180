// Base tilt: the base rotates as the inclinometer mounted on it reads, times a factor.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The base rotates about its origin by value times the inclinometer reading, columns tilt_x_deg
/// and tilt_y_deg: rotations about x and y of W. Unit: 1; a base that rotates exactly as the
/// inclinometer reads has 1. Gravity keeps its direction in W. Valid for milliradians. Adds nothing
/// without the columns.
const Effect& BaseTilt();

}  // namespace plumbline::effects
