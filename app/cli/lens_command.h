// plumbline lens: what the daemon's lens store holds, and a lens solved again from its views.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddLensCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
