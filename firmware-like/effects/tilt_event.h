// Tilt event: a base that tilted suddenly.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// From the event onwards (t_s >= time, or row number >= row, counted from 1), the base is rotated
/// about its origin by x about the x axis and y about the y axis of W. Typical causes: slipped
/// anchor bolts, a settled floor, a new session on a mobile platform. File units: s, 1, deg. Adds
/// nothing if no event time is given or its signal is unknown. Valid for rotations of milliradians.
/// The event time has no derivative and must be found by search.
const Effect& TiltEvent();

}  // namespace plumbline::effects
