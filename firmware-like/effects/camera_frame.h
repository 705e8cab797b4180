// Camera frame error: one of several cameras measures with another pose and scale than the others.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The rows of one camera are displaced rigidly and enlarged; to first order
///   p read = (1 + scale) (p_WB + (x, y, z) + (p - p_WB) + (roll, pitch, yaw) x (p - p_WB)),
/// with the tip p and the origin of the base p_WB in W, rotations about the axes of W, and the
/// scale about the origin of W. Its causes are the lens (focal length, distortion) and the pose in
/// which the camera was located. `camera` names the camera as the rows do, "side+rear" for means of
/// two. The arm itself is not affected, so a correction ignores this effect. Unlike base_frame it
/// does not rotate gravity; valid for a vertical gravity in W and angles up to a degree. If all
/// rows are of one camera, base_frame and measurement_scale are equivalent, so it is considered
/// only if the rows are of different instruments. If the base is free, no data can decide which
/// camera has a wrong pose; a wrong scale contradicts the lengths of the arm. File units: mm, deg,
/// 1.
const Effect& CameraFrame();

}  // namespace plumbline::effects
