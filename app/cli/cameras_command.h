// plumbline cameras: what cameras there are, what they can send, and how to name them.
#pragma once

#include <string>

#include "drivers/camera/v4l2_device.h"

namespace CLI {
class App;
}

namespace plumbline {

void AddCamerasCommand(CLI::App& app, int& exit_code);

/// {"cameras": [{"device", "select", "name", "driver", "serial", "port", "problem", "modes":
/// [{"format", "readable", "width", "height", "smallest", "step", "rates_hz"}], "controls":
/// [{"name", "smallest", "largest", "standard", "value"}]}]}; `smallest` and `step` only where a
/// mode is a range of sizes, `problem` null where the camera answers.
std::string CamerasJson(const DeviceTree& tree);

/// The same to be read.
std::string CamerasText(const DeviceTree& tree);

}  // namespace plumbline
