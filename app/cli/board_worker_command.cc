// plumbline board-worker: child process of plumblined that detects boards; hidden from --help.
#include <CLI/CLI.hpp>

#include "app/cli/commands.h"
#include "app/vision/camera/board_worker.h"

namespace plumbline::cli {

void AddBoardWorkerCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("board-worker", "Detects boards for plumblined");
  command->callback([&exit_code] { exit_code = vision::RunBoardWorker(); });
}

}  // namespace plumbline::cli
