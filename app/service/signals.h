// How a long-running process is told to end, or to read its configuration again.
#pragma once

namespace plumbline {

/// SIGTERM, SIGINT and SIGHUP as a file descriptor that reads a signalfd_siginfo each and does not
/// block; blocked in every thread started afterwards.
int OpenSignals();

}  // namespace plumbline
