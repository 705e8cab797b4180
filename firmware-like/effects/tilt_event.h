// A base that tilted at one moment.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// From the moment on, t_s >= time or row >= row (the first row being 1), the base is turned about
/// its origin by x about W's x and y about W's y: anchor bolts that slipped, a floor that settled,
/// a new session on a mobile platform. Units of the files: s, 1, deg. Without a moment, or where
/// its signal is unknown, nothing. Valid for milliradians. The moment has no derivative: search it.
const Effect& TiltEvent();

}  // namespace plumbline
