// plumbline calibrate-lens: a lens from images of a chessboard.
#pragma once

#include <CLI/CLI.hpp>

namespace plumbline {

void AddCalibrateLensCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
