// The daemon: ordered start, control cycle, reload and stop by signal.
#pragma once

#include <string>

namespace plumbline::cell {

/// Runs until SIGTERM or SIGINT. SIGHUP reloads the configuration: a faulty one changes nothing;
/// a change of the PLC servers' addresses or ports needs a restart.
/// @param port_file  receives the PLC server's port once the daemon runs; empty: none
/// @return  the process's exit code: 0 stopped by a signal, 1 faults in the configuration or a part
///          that could not start, 2 the state directory or the PLC's port is in use; the reason is
///          logged
int RunDaemon(const std::string& config_file, const std::string& port_file = "");

}  // namespace plumbline::cell
