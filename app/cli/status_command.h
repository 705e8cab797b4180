// plumbline status: what a running daemon says of itself, read as a PLC would.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddStatusCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
