// Termination and reload signals of a long-running process, as a file descriptor.
#pragma once

namespace plumbline::service {

// Limit on the open files and sockets of this process.

/// Raises the soft limit to `wanted`, or to the hard limit if that is lower. Never lowers it.
/// @return  the limit now in effect
int RaiseDescriptorLimit(int wanted);

/// Blocks SIGTERM, SIGINT and SIGHUP in this thread and all threads started afterwards.
/// @return  a non-blocking signalfd(2) that delivers them, owned by the caller; -1 on failure
int OpenSignalDescriptor();

}  // namespace plumbline::service
