// Tilt event: a base that tilted at one time.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// From the event on (t_s >= time, or row >= row with the first row being 1), the base is rotated
/// about its origin by x about the x axis and y about the y axis of W: slipped anchor bolts, a
/// settled floor, a new session on a mobile platform. File units: s, 1, deg. Adds nothing if no
/// event time is given or its signal is unknown. Valid for milliradians. The event time has no
/// derivative and must be searched.
const Effect& TiltEvent();

}  // namespace plumbline::effects
