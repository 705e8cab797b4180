// plumbline import-urdf: a cell from a URDF or from a UR's factory calibration.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddImportUrdfCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
