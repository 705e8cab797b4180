// The publisher as a service.
#pragma once

#include <string>

namespace plumbline {

/// Runs until SIGTERM or SIGINT; SIGHUP reads the configuration again.
/// @return  the process's exit code: 0 ended by signal, 1 faults in the configuration or no [mqtt],
///          2 the queue cannot be used
int RunFleet(const std::string& config_file);

}  // namespace plumbline
