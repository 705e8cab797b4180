// Guidance of the person who holds the calibration board: outline in the image, instruction, ring
// of views and map of what is still unknown.
#pragma once

#include <optional>

#include "app/display/view/picture_writer.h"
#include "app/display/view/status_text.h"

namespace plumbline::display {

/// Whether this camera captures the calibration board.
bool IsGuiding(const cell::ViewCamera& camera);

/// The first displayed camera that captures the board.
std::optional<std::size_t> GuidingCamera(const ViewFacts& facts);

/// "3 of about 9 views"; without guidance "3 views".
std::string BoardViewsText(const cell::ViewCamera& camera);

/// Adds to the camera's image in the layout's image area where the board is wanted, and where it is
/// seen. An edge that comes nearer to the camera is drawn wider. Green once the board is there.
void AddBoardOutlines(const cell::ViewCamera& camera, PictureWriter& writer);

/// Adds the instruction, in the largest type, in place of the details, and in place of the points a
/// ring with one segment for each view, filled as they are captured, and the map of the image,
/// amber where the claim is not met yet.
void AddBoardGuide(const cell::ViewCamera& camera, PictureWriter& writer);

}  // namespace plumbline::display
