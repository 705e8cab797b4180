#include "app/cli/board_worker_command.h"

#include <CLI/CLI.hpp>

#include "app/vision/camera/board_worker.h"

namespace plumbline::cli {

void AddBoardWorkerCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("board-worker", "Detects boards for plumblined");
  command->group("");  // hidden: only plumblined starts it
  command->callback([&exit_code] { exit_code = vision::RunBoardWorker(); });
}

}  // namespace plumbline::cli
