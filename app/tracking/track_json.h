// What a tracked frame is, for programs and for people.
#pragma once

#include <cstdint>
#include <string>

#include "app/tracking/tracker.h"

namespace plumbline {

/// {"tags": [{"id", "corners_px", "pose", "ambiguous"}], "bodies": [{"name", "pose", "ambiguous",
/// "tags", "left_out"}]}. pose is {"t_mm", "quaternion_wxyz", "sd": {"t_mm", "rotation_deg"}}: the
/// tag (or body) in the camera frame, one standard deviation along the camera's axes; null where
/// the tag's size is not known or no pose fits. w is not negative.
std::string TrackJson(const TrackedFrame& frame);

/// The same in one line, for a frame of a live camera: "t_s", since its first frame, and "sequence"
/// come before the rest.
std::string TrackJsonLine(const TrackedFrame& frame, double t_s, std::uint64_t sequence);

/// The same as a table.
std::string TrackText(const TrackedFrame& frame);

}  // namespace plumbline
