// plumbline calibrate-hand-eye: hand-eye calibration of a camera from images and robot poses.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddCalibrateHandEyeCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
