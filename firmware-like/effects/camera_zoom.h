// A camera that was zoomed, or focused, and goes on with its old focal length.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// A body of known size seen with the focal length f, its pose solved with f (1 + scale): its image
/// and its place beside the optical axis agree for every depth, X = x Z / f; its size then asks for
/// the depth (1 + scale) Z. So the reading is stretched along the optical axis, not along the ray:
///   Z read = (1 + scale) Z,  X and Y as they are, in the camera's frame.         Unit: 1.
/// From a moment on (time, t_s >= time; or row, the first row being 1), or in all rows where no
/// moment is given; a zoom in and out again is two of them, of opposite sign. The moment has no
/// derivative: search it, where zoom_counts is recorded among its changes only. Valid for bodies
/// that are small beside their distance and a camera whose pose was found before the change; a
/// principal point that moves with the zoom turns the camera, which base_frame imitates.
/// Told from camera_tag_size by poses spread beside the axis as much as along it, at least about
/// 6 sigma / scale; from a step of the base by depth that varies.
const Effect& CameraZoom();

}  // namespace plumbline
