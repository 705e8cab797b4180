// plumbline mesh: checks mesh files for the overlay.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddMeshCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
