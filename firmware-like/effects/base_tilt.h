// A base that follows an inclinometer mounted on it.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The base turns about its origin by value times what an inclinometer on it reads, the columns
/// tilt_x_deg and tilt_y_deg: turns about W's x and y. Unit: 1; a base that turns as the
/// inclinometer does has 1. Gravity keeps its direction in W. Valid for milliradians. Without the
/// columns nothing.
const Effect& BaseTilt();

}  // namespace plumbline
