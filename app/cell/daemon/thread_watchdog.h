// Watchdog over the daemon's threads, by their heartbeat counters.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/gauge_worker.h"
#include "app/cell/daemon/monitoring_worker.h"

namespace plumbline::cell {

/// Finds threads whose heartbeat counter has stopped, except while they wait for a device. Pure:
/// time is an input. Used by one thread.
class ThreadWatchdog {
 public:
  /// How long a thread may wait for a device, such as a disk that retries or a USB camera that
  /// times out. A restart would not help meanwhile: the kernel cannot end a thread in that state.
  static constexpr double kDeviceTimeout_s = 30;

  /// @param beats       reads the thread's heartbeat counter
  /// @param timeout_s   longest time without a heartbeat
  /// @param in_device   whether the thread is waiting for a device now; only called once half of
  ///                    the timeout has passed
  void Add(
      std::string thread, double timeout_s, std::function<std::uint64_t()> beats,
      std::function<bool()> in_device = [] { return false; });

  /// Changes the timeout of a thread that was added.
  void SetTimeout(const std::string& thread, double timeout_s);

  struct StalledThread {
    std::string name;     ///< empty if every thread is responsive
    double silent_s = 0;  ///< since its last heartbeat
  };
  /// @return  the first thread, in the order of Add(), that is stalled
  StalledThread Check(double now_s);

 private:
  struct Thread {
    std::string name;
    double timeout_s;
    std::function<std::uint64_t()> beats;
    std::function<bool()> in_device;
    std::uint64_t last_beats = 0;
    double last_beat_s = 0;
    double excused_until_s = 0;  ///< last heartbeat, or last time it was waiting for a device
    bool checked = false;
  };
  std::vector<Thread> threads_;
};

// Threads of the daemon that the watchdog monitors, with their timeouts.

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
