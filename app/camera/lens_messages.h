// Log entries of the lens supervision.
#pragma once

#include <string>

#include "app/camera/tag_check.h"
#include "app/lens/declared_facts.h"
#include "app/log/log_entry.h"
#include "firmware-like/lens/zoom_supervisor.h"

namespace plumbline::camera {

/// @param tags  message of the last tag check, which explains a lens that the tags reject
log::LogEntry TransitionEntry(const lens::ZoomTransition& transition, const std::string& tags);

log::LogEntry LensFoundEntry(const ActiveLens& lens);

/// A stored lens that is not used.
/// @param missing  the declarations on which it rests and that [camera] no longer makes
log::LogEntry LensWithheldEntry(std::int64_t id, const lens::DeclaredFacts& missing);

/// The reference tags are read as another library draws them.
/// @param opencv  as OpenCV draws them, no longer as the AprilTag library does
log::LogEntry PrintsEntry(const std::string& family, bool opencv);

/// The reference tags contradict a calibration since it was accepted.
log::LogEntry ContradictionEntry(const TagCheck& check);

}  // namespace plumbline::camera
