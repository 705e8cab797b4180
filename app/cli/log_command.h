// plumbline log: what happened, and what to do about it.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddLogCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
