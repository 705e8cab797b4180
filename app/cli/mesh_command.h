// plumbline mesh: what is in a mesh file.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddMeshCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
