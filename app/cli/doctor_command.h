// plumbline doctor: what is wrong with this installation.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddDoctorCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
