// plumbline cameras: list of the connected cameras with their names, modes and controls.
#pragma once

#include <string>

#include "drivers/camera/v4l2_device.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddCamerasCommand(CLI::App& app, int& exit_code);

/// {"cameras": [{"device", "select", "name", "driver", "serial", "port", "problem", "modes":
/// [{"format", "readable", "width", "height", "smallest", "step", "rates_hz"}], "controls":
/// [{"name", "smallest", "largest", "standard", "value"}]}]}. A mode has `smallest` and `step` only
/// if it is a range of sizes; `problem` is null if the camera responds.
std::string CamerasJson(const camera::DeviceTree& tree);

/// The same as readable text.
std::string CamerasText(const camera::DeviceTree& tree);

}  // namespace plumbline::cli
