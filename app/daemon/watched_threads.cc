#include "app/daemon/watched_threads.h"

#include "app/daemon/device_wait.h"
#include "drivers/robot/host_name.h"

namespace plumbline::daemon {
namespace {

/// The monitoring worker may wait for another program's lock on
/// the journal; the robot thread for a name server, if the controller is configured by name.
constexpr double kThreadTimeout_s = 2, kMonitoringTimeout_s = 5.5, kNameLookupTimeout_s = 60;

}  // namespace

double RobotTimeout_s(const config::DaemonConfig& config) {
  constexpr double kRequestsPerPush = 7;
  if (config.robot.transport == "tcp" && !robot::IsAddress(config.robot.connection.tcp.host)) {
    return kNameLookupTimeout_s;
  }
  return kThreadTimeout_s + kRequestsPerPush * config.robot.connection.timeout_s;
}

void AddThreads(const config::DaemonConfig& config, const ControlCycle& cycle,
                const MonitoringWorker& worker, const GaugeWorker& gauges,
                ThreadWatchdog& watchdog) {
  watchdog.Add("control cycle", kThreadTimeout_s, [&cycle] { return cycle.heartbeat().beats(); });
  watchdog.Add(
      kRobotLink, RobotTimeout_s(config),
      [&cycle] { return cycle.parts().link->heartbeat().beats(); },
      [&cycle] { return IsWaitingForDevice(cycle.parts().link->heartbeat().thread()); });
  watchdog.Add(
      "monitoring worker", kMonitoringTimeout_s, [&worker] { return worker.heartbeat().beats(); },
      [&worker] { return IsWaitingForDevice(worker.heartbeat().thread()); });
  watchdog.Add(
      "gauges", kThreadTimeout_s, [&gauges] { return gauges.beats(); },
      [&gauges] { return IsWaitingForDevice(gauges.heartbeat().thread()); });
}

}  // namespace plumbline::daemon
