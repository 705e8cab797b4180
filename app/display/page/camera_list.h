// The cameras of this computer with the command that chooses one, for the page's commissioning
// view.
#pragma once

#include <string>
#include <vector>

#include "drivers/camera/v4l2_device.h"

namespace plumbline::display {

/// The cameras behind the video nodes as JSON: {"cameras": [{"name", "device", "select", "serial",
/// "port", "command"}]}. Several nodes of one camera are listed once. `command` prints the lines of
/// plumbline.toml that select the camera; it is null if the camera's name contains characters that
/// a shell interprets, since names come from the device and the command is made to be pasted.
/// @param nodes  as ListVideoNodes() returns them
std::string CameraListJson(const std::vector<camera::V4l2Device>& nodes);

}  // namespace plumbline::display
