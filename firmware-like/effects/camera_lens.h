// A stale lens: distortion that is no longer that of the calibration in use.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The lens has k1 more than the calibration takes away (OpenCV's first radial term). With
/// r^2 = (X^2 + Y^2) / Z^2 a ray comes out at (1 + k1 r^2) of its angle, and a body there larger by
/// (1 + 2 k1 r^2), the mean of 3 along the radius and 1 across it, hence nearer:
///   X, Y read = (1 - k1 r^2) X, Y,   Z read = (1 - 2 k1 r^2) Z, in the camera's frame.  Unit: 1.
/// First order in k1. A flat body takes between 1 and 3 of k1 r^2 in place of 2, by its tilt; one
/// whose tags face several ways takes 2. The tip stands beside the body. Told from camera_zoom and
/// camera_tag_size by poses near the image's middle and at its edge alike.
const Effect& CameraLens();

}  // namespace plumbline
