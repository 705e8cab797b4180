#include "app/cell/daemon/thread_watchdog.h"

#include <algorithm>
#include <utility>

#include "app/cell/daemon/device_wait.h"
#include "drivers/clock.h"
#include "drivers/robot/host_name.h"

namespace plumbline::cell {
namespace {

/// The monitoring worker may wait for another program's lock on
/// the journal; the robot thread for a name server, if the controller is configured by name.
constexpr double kThreadTimeout_s = 2, kMonitoringTimeout_s = 5.5, kNameLookupTimeout_s = 60;

}  // namespace

double RobotTimeout_s(const config::DaemonConfig& config) {
  constexpr int kRequestsPerPush = 7, kPassesPerReading = 3;
  const robot::RobotConnection& link = config.robot.connection;
  const bool rtde = config.robot.transport == "rtde";
  if ((rtde || config.robot.transport == "tcp") && !robot::IsAddress(link.tcp.host)) {
    return kNameLookupTimeout_s;
  }
  // Connection, two versions, controller, outputs twice, inputs, start, first package; each reply
  // is awaited for at least half a second.
  constexpr int kExchangesPerRtdeConnection = 9;
  constexpr double kLeastReply_s = 0.5;
  if (rtde)
    return kThreadTimeout_s + kExchangesPerRtdeConnection * std::max(link.timeout_s, kLeastReply_s);
  const int per_pass = static_cast<int>(link.profile.blocks.size()) + 1;  // and a marker
  const double requests = std::max(kRequestsPerPush, kPassesPerReading * per_pass);
  if (config.robot.transport != "rtu") return kThreadTimeout_s + requests * link.timeout_s;
  // The line is synchronised first: three times silence, a marker, silence. See ModbusClient.
  constexpr double kLongestFrame_bits = 256 * 11, kSynchronisations = 3;
  const double frame_s = kLongestFrame_bits / link.serial.baud;
  const double request_s = link.timeout_s + frame_s;
  return kThreadTimeout_s + requests * request_s +
         kSynchronisations * (2 * request_s + 4 * frame_s);
}

void AddThreads(const config::DaemonConfig& config, const ControlCycle& cycle,
                const MonitoringWorker& worker, const GaugeWorker& gauges,
                ThreadWatchdog& watchdog) {
  watchdog.Add("control cycle", kThreadTimeout_s, [&cycle] { return cycle.heartbeat().beats(); });
  watchdog.Add(
      kRobotLink, RobotTimeout_s(config),
      [&cycle] { return cycle.parts().link->heartbeat().beats(); },
      [&cycle] { return IsWaitingForDevice(cycle.parts().link->heartbeat().thread()); });
  watchdog.Add("motion link", kThreadTimeout_s, [&cycle] {
    const auto& motion = cycle.parts().motion;
    // Without the thread, the clock stands in for its heartbeat.
    return motion && !motion->ended() ? motion->heartbeat().beats()
                                      : static_cast<std::uint64_t>(1e3 * MonotonicSeconds());
  });
  watchdog.Add(
      "monitoring worker", kMonitoringTimeout_s, [&worker] { return worker.heartbeat().beats(); },
      [&worker] { return IsWaitingForDevice(worker.heartbeat().thread()); });
  watchdog.Add(
      "gauges", kThreadTimeout_s, [&gauges] { return gauges.beats(); },
      [&gauges] { return IsWaitingForDevice(gauges.heartbeat().thread()); });
}

namespace {

/// Fraction of the timeout after which the watchdog checks whether a thread waits for a device.
constexpr double kLateFraction = 0.5;

}  // namespace

void ThreadWatchdog::Add(std::string thread, double timeout_s, std::function<std::uint64_t()> beats,
                         std::function<bool()> in_device) {
  threads_.push_back({std::move(thread), timeout_s, std::move(beats), std::move(in_device)});
}

void ThreadWatchdog::SetTimeout(const std::string& name, double timeout_s) {
  for (Thread& thread : threads_) {
    if (thread.name == name) thread.timeout_s = timeout_s;
  }
}

ThreadWatchdog::StalledThread ThreadWatchdog::Check(double now_s) {
  StalledThread first;
  for (Thread& thread : threads_) {
    const std::uint64_t beats = thread.beats();
    if (!thread.checked || beats != thread.last_beats) {
      thread.checked = true;
      thread.last_beats = beats;
      thread.last_beat_s = thread.excused_until_s = now_s;
    }
    const double silent_s = now_s - thread.last_beat_s;
    if (silent_s > kLateFraction * thread.timeout_s && silent_s <= kDeviceTimeout_s &&
        thread.in_device()) {
      thread.excused_until_s = now_s;
    }
    if (first.name.empty() && now_s - thread.excused_until_s > thread.timeout_s) {
      first = {thread.name, silent_s};
    }
  }
  return first;
}

}  // namespace plumbline::cell
