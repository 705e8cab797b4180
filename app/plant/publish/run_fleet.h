// Service entry point of plumbline-fleet.
#pragma once

#include <string>

namespace plumbline::plant {

/// Runs until SIGTERM or SIGINT; SIGHUP reloads the configuration.
/// @return  the exit code: 0 stopped by a signal, 1 faults in the configuration or no [mqtt], 2 the
///          queue cannot be used
int RunFleet(const std::string& config_file);

}  // namespace plumbline::plant
