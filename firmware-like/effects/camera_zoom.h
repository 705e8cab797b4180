// Uncorrected zoom change: a camera that was zoomed or focused but uses its old focal length.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// A body of known size is imaged with the focal length f, but its pose is solved with f (1 +
/// scale). Its image position beside the optical axis is consistent for every depth, X = x Z / f,
/// while its image size requires the depth (1 + scale) Z. The reading is therefore stretched along
/// the optical axis, not the ray:
///   Z read = (1 + scale) Z,  X and Y unchanged, in the camera frame.         Unit: 1.
/// Acts from an event on (t_s >= time, or row >= row with the first row being 1), or in all rows if
/// no event time is given; zooming in and out again is two effects of opposite sign. The event time
/// has no derivative and must be searched; if zoom_counts was recorded, only among its changes.
/// Valid for bodies that are small compared with their distance and a camera whose pose was
/// determined before the change. A principal point that moves with the zoom acts like a rotated
/// camera, equivalent to base_frame. Separated from camera_tag_size by poses spread beside the axis
/// as much as along it, by at least about 6 sigma / scale; from a step of the base by varying
/// depth.
const Effect& CameraZoom();

}  // namespace plumbline::effects
