// plumbline lens: lists the daemon's lens store and solves a lens again from its stored views.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddLensCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
