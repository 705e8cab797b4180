// plumbline board-worker: the daemon's own, not shown by --help.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddBoardWorkerCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
