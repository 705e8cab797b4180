// plumbline calibrate-lens: lens calibration from images of a board.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddCalibrateLensCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
