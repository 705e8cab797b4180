// The running parts of the daemon, as the main thread uses them.
#pragma once

#include <string>

#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/controller_watch.h"
#include "app/cell/daemon/cycle_affinity.h"
#include "app/cell/daemon/display_feed.h"
#include "app/cell/daemon/gauge_worker.h"
#include "app/cell/daemon/model_in_force.h"
#include "app/cell/daemon/monitoring_worker.h"
#include "app/cell/daemon/plc_servers.h"
#include "app/cell/daemon/thread_watchdog.h"

namespace plumbline::cell {

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
  CycleMailboxes& mailboxes;
  CycleAffinity affinity{};
  ControllerWatch controller{log::Log};
};

}  // namespace plumbline::cell
