// Threads of the daemon that the watchdog monitors, with their timeouts.
#pragma once

#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/gauge_worker.h"
#include "app/cell/daemon/monitoring_worker.h"
#include "app/cell/daemon/thread_watchdog.h"

namespace plumbline::cell {

/// Name of the robot link's thread; its timeout changes with the configuration.
inline constexpr char kRobotLink[] = "robot link";

/// Watchdog timeout of the robot link: pushing one point takes seven requests, each of which may
/// take nearly its own timeout.
double RobotTimeout_s(const config::DaemonConfig& config);

/// Adds the control cycle, the robot link, the monitoring worker and the gauges.
void AddThreads(const config::DaemonConfig& config, const ControlCycle& cycle,
                const MonitoringWorker& worker, const GaugeWorker& gauges,
                ThreadWatchdog& watchdog);

}  // namespace plumbline::cell
