// Tags that are not as large as the camera was told.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The camera takes each distance from the size of the tags: told a tag (1 + scale) times as large
/// as it is, it sees the tip that much farther off along its ray,
///   p_WT read = c + (1 + scale) (p_WT - c),   c the camera's place in W.        Unit: 1.
/// The arm itself is right: for a correction this is nothing to correct. All tags that the tip is
/// measured by have the same error; those that told where the camera stands have none (if they have
/// it too, everything grows about W's origin: measurement_scale). It is measurement_scale and a
/// shift of -scale c: where the base is free, or c = 0, no rows can tell the two apart; where the
/// base is known, scale |c| above the noise does.
const Effect& CameraTagSize();

}  // namespace plumbline
