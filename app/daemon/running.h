// The running parts of the daemon, as the main thread uses them.
#pragma once

#include <string>

#include "app/daemon/control_cycle.h"
#include "app/daemon/cycle_affinity.h"
#include "app/daemon/display_feed.h"
#include "app/daemon/gauge_worker.h"
#include "app/daemon/model_in_force.h"
#include "app/daemon/monitoring_worker.h"
#include "app/daemon/plc_servers.h"
#include "app/daemon/thread_watchdog.h"
#include "app/service/service_manager.h"

namespace plumbline::daemon {

struct Running {
  const std::string& file;              ///< path of the configuration
  const config::DaemonConfig& started;  ///< the configuration at the start
  ControlCycle& cycle;
  MonitoringWorker& worker;
  DisplayFeed& display;
  GaugeWorker& gauges;
  PlcServers& plc;
  const service::ServiceManager& manager;
  ThreadWatchdog watchdog;
  double robot_timeout_s;  ///< of the present robot link
  RunningDaemon state;
  CycleAffinity affinity{};
};

}  // namespace plumbline::daemon
