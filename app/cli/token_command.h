// `plumbline token`.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

/// Adds the command; its callback sets `exit_code`.
void AddTokenCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
