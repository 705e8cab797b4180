// plumbline status: prints the state of a running daemon, read from its Modbus registers.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddStatusCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
