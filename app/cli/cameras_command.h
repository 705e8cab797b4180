// plumbline cameras: list of the connected cameras with their names, modes and controls.
#pragma once

#include <string>

#include "drivers/camera/v4l2_device.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// {"cameras": [{"device", "select", "name", "driver", "serial", "port", "problem", "modes":
/// [{"format", "readable", "width", "height", "smallest", "step", "rates_hz"}], "controls":
/// [{"name", "smallest", "largest", "standard", "value"}]}]}. A mode has `smallest` and `step` only
/// if it is a range of sizes; `problem` is null if the camera responds.
std::string CamerasJson(const camera::DeviceTree& tree);

/// The same as readable text.
std::string CamerasText(const camera::DeviceTree& tree);

/// The table [camera] of plumbline.toml for a camera of the list, with its largest mode.
/// @param which  its number, from 1 in the order of the list, or its name (SelectV4l2Device())
/// @return       error if there is no such camera, or it cannot be used
Result<std::string> CameraTable(const camera::DeviceTree& tree, const std::string& which);

}  // namespace plumbline::cli
