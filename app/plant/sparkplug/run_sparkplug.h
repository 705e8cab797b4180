// Service entry point of plumbline-sparkplug.
#pragma once

#include <string>

namespace plumbline::plant {

/// Runs until SIGTERM or SIGINT; SIGHUP starts all connections anew with the configuration read
/// again.
/// @return  the exit code: 0 stopped by a signal, 1 faults in the configuration
int RunSparkplug(const std::string& config_file);

}  // namespace plumbline::plant
