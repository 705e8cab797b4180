// plumbline distance: measures distances and points of the object table.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddDistanceCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
