// plumbline doctor: diagnosis of the installation.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddDoctorCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
