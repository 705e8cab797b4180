// The daemon: ordered start, one cyclic thread, reload and end by signal.
#pragma once

#include <string>

namespace plumbline {

/// Runs until SIGTERM or SIGINT. SIGHUP reads the configuration again: a faulty one changes
/// nothing; addresses and ports of the PLC side keep until a restart.
/// @return the process's exit code: 0 ended by signal, 1 faults in the configuration or a part
///         that could not start (told in the log)
int RunDaemon(const std::string& config_file);

}  // namespace plumbline
