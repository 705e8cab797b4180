// Feeder of the service manager's watchdog.
#pragma once

#include <string>

#include "app/base/service/service_manager.h"
#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/thread_watchdog.h"

namespace plumbline::cell {

/// Feeds the service manager's watchdog while every thread is responsive, and shows a status line
/// every few seconds. Logs a stalled thread, and has the daemon restarted.
class WatchdogFeeder {
 public:
  WatchdogFeeder(ThreadWatchdog& threads, const service::ServiceManager& manager)
      : threads_(threads), manager_(manager) {}

  /// To be called several times a second.
  void Update(const Snapshot& snapshot, const CycleCounters& counters, double now_s);

 private:
  void ReportStalled(const ThreadWatchdog::StalledThread& stalled);

  ThreadWatchdog& threads_;
  const service::ServiceManager& manager_;
  std::string stalled_;  ///< the thread that was logged as stalled; empty: none
  double fed_s_ = -1e300, status_s_ = -1e300;
};

}  // namespace plumbline::cell
