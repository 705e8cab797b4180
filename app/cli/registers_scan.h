// plumbline registers scan: finds out how a controller's registers hold the joints.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

/// Adds `scan` to the command `registers`.
void AddRegistersScan(CLI::App& registers, int& exit_code);

}  // namespace plumbline::cli
