// plumbline model: versions of the cell's model; which one is in force.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddModelCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
