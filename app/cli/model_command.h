// plumbline model: lists, proposes, applies and rolls back versions of the cell's model.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddModelCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
