// Output of a tracked frame: JSON and readable text.
#pragma once

#include <cstdint>
#include <string>

#include "app/vision/tracking/tracker.h"

namespace plumbline::vision {

/// {"tags": [{"id", "corners_px", "pose", "ambiguous"}], "bodies": [{"name", "pose", "ambiguous",
/// "tags", "left_out"}]}. pose is {"t_mm", "quaternion_wxyz", "sd": {"t_mm", "rotation_deg"}}: the
/// tag (or body) in the camera frame, with one standard deviation in the camera's axes; null if the
/// tag's size is unknown or no pose fits. w is not negative.
std::string TrackJson(const TrackedFrame& frame);

/// The same in one line for a frame of a live camera, with "t_s" (time since its first frame) and
/// "sequence" in front.
std::string TrackJsonLine(const TrackedFrame& frame, double t_s, std::uint64_t sequence);

/// A readable table.
std::string TrackText(const TrackedFrame& frame);

}  // namespace plumbline::vision
