// plumbline board-worker: child process of plumblined that detects boards; hidden from --help.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddBoardWorkerCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
