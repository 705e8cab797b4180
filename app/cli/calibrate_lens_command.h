// plumbline calibrate-lens: a lens from images of a chessboard.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddCalibrateLensCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
