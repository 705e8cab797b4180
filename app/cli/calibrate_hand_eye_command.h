// plumbline calibrate-hand-eye: where the camera is, by the robot's own motion.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddCalibrateHandEyeCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
