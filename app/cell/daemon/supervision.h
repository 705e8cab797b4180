// Main thread's loop while the daemon runs.
#pragma once

#include "app/cell/daemon/running.h"

namespace plumbline::cell {

/// Logs transitions, reloads on SIGHUP and feeds the watchdog until SIGTERM or SIGINT.
/// @param signals  descriptor that SIGHUP, SIGTERM and SIGINT are read from
void Supervise(int signals, Running& running);

}  // namespace plumbline::cell
