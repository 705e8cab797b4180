// Termination and reload signals of a long-running process, as a file descriptor.
#pragma once

namespace plumbline::service {

/// Blocks SIGTERM, SIGINT and SIGHUP in this thread and all threads started afterwards.
/// @return  a non-blocking signalfd(2) that delivers them, owned by the caller; -1 on failure
int OpenSignalDescriptor();

}  // namespace plumbline::service
