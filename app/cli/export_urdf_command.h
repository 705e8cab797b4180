// plumbline export-urdf: corrected kinematics written back into a URDF.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddExportUrdfCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
