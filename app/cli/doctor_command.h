// plumbline doctor: diagnosis of the installation.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddDoctorCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
