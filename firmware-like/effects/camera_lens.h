// Stale lens: lens distortion that has changed since calibration.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The actual k1 exceeds the calibrated one (OpenCV's first radial coefficient) by the value. With
/// r^2 = (X^2 + Y^2) / Z^2, a ray appears at (1 + k1 r^2) times its angle, and a body there appears
/// larger by 1 + 2 k1 r^2, the mean of 3 k1 r^2 radially and k1 r^2 tangentially, and therefore
/// closer:
///   X, Y read = (1 - k1 r^2) X, Y,   Z read = (1 - 2 k1 r^2) Z, in the camera frame.  Unit: 1.
/// First order in k1. For a flat body the factor 2 is between 1 and 3, depending on its tilt; for a
/// body with tags facing several ways it is 2. The tip is assumed to be next to the body. Separable
/// from camera_zoom and camera_tag_size if there are poses both near the centre and at the edge of
/// the image.
const Effect& CameraLens();

}  // namespace plumbline::effects
