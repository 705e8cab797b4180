// Service of plumbline-collect: from the broker to the database until a signal ends it.
#pragma once

#include <string>

namespace plumbline::plant {

/// @return  exit code: 0 stopped by a signal, 1 faults in the configuration
int RunCollect(const std::string& config_file);

}  // namespace plumbline::plant
