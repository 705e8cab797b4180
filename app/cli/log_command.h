// plumbline log: prints the log of the daemon and the display, and the event catalogue.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddLogCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
