// plumbline distance: distances and points of the object table, by name.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddDistanceCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
