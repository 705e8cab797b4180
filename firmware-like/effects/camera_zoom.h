// Uncorrected zoom change: the zoom or focus has changed, but the old focal length is used.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// A body of known size is imaged with the focal length f, but its pose is solved with f (1 +
/// scale). Its image position x relative to the optical axis is consistent with any depth, as
/// X = x Z / f, but its image size requires the depth (1 + scale) Z. The reading is therefore
/// stretched along the optical axis, not along the ray:
///   Z read = (1 + scale) Z,  X and Y unchanged, in the camera frame.         Unit: 1.
/// Acts from an event onwards (t_s >= time, or row number >= row, counted from 1), or in all rows
/// if no event time is given; zooming in and out again is modelled as two effects of opposite sign.
/// The event time has no derivative and must be found by search; if zoom_counts was recorded, only
/// the times at which it changes are candidates. Valid for bodies that are small compared with
/// their distance and a camera whose pose was determined before the change. A principal point that
/// moves with the zoom acts like a rotated camera, equivalent to base_frame. Separable from
/// camera_tag_size if the poses are spread across the optical axis as well as along it, by at least
/// about 6 sigma / scale; from a step of the base if their depths differ.
const Effect& CameraZoom();

}  // namespace plumbline::effects
