// Log entries of the lens supervision.
#pragma once

#include <string>

#include "app/base/log/log_entry.h"
#include "app/base/target/declared_facts.h"
#include "app/vision/camera/tag_check.h"
#include "firmware-like/lens/board_guidance.h"
#include "firmware-like/lens/board_prompt.h"
#include "firmware-like/lens/zoom_supervisor.h"

namespace plumbline::vision {

/// @param tags  message of the last tag check, which explains a lens that the tags reject
log::LogEntry TransitionEntry(const lens::ZoomTransition& transition, const std::string& tags);

/// "1 view", "2 views".
std::string BoardViewsText(std::size_t count);

/// A further view of the board was kept.
log::LogEntry BoardProgressEntry(lens::BoardPrompt prompt, const lens::BoardGuidance& guidance);

log::LogEntry LensFoundEntry(const ActiveLens& lens);

/// A stored lens that is not used.
/// @param missing  the declarations on which it rests and that [camera] no longer makes
log::LogEntry LensWithheldEntry(std::int64_t id, const target::DeclaredFacts& missing);

/// The reference tags are read as another library draws them.
/// @param opencv  as OpenCV draws them, no longer as the AprilTag library does
log::LogEntry PrintsEntry(const std::string& family, bool opencv);

/// The reference tags contradict a calibration since it was accepted.
log::LogEntry ContradictionEntry(const TagCheck& check);

}  // namespace plumbline::vision
