// Wrong tag size: the tags are larger or smaller than configured for the camera.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The camera scales distances by the configured tag size. If that is (1 + scale) times the actual
/// size, the tip appears further away along its ray:
///   p_WT read = c + (1 + scale) (p_WT - c),   c the camera's position in W.        Unit: 1.
/// The arm itself is not affected, so a correction ignores this effect. It is assumed that all tags
/// used for the tip have the same error and those used to locate the camera have none (if they have
/// the same error too, everything scales about the origin of W: measurement_scale). Equivalent to
/// measurement_scale plus a shift of -scale c: if the base is free, or c = 0, no data can separate
/// the two; with a known base, they are separable if scale |c| exceeds the noise.
const Effect& CameraTagSize();

}  // namespace plumbline::effects
