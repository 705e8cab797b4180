#include "app/cell/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <optional>
#include <string>

#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/cell/daemon/camera_supervisors.h"
#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/cycle_setup.h"
#include "app/cell/daemon/reload.h"
#include "app/cell/daemon/running.h"
#include "app/cell/daemon/state_storage.h"
#include "app/cell/daemon/thread_watchdog.h"
#include "app/cell/model_store/configuration_note.h"
#include "app/version.h"
#include "drivers/os/port_file.h"

namespace plumbline::cell {
namespace {

// Main thread's loop while the daemon runs.

// Feeder of the service manager's watchdog.

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

constexpr double kStatusPeriod_s = 5;

/// One line for `systemctl status`: health, robot, valid points.
std::string StatusLine(const Snapshot& snapshot, const CycleCounters& counters) {
  const auto valid = std::count_if(snapshot.points.begin(), snapshot.points.end(),
                                   [](const PointResult& point) { return point.valid; });
  return fmt::format(
      "{}: {}; {}, {} of {} points valid, cycle {}", Describe(snapshot.health.severity),
      snapshot.health.reason == HealthReason::kNone ? "no fault" : Describe(snapshot.health.reason),
      (snapshot.status & status::kRobotLink) != 0 ? "robot trusted" : "no robot", valid,
      snapshot.points.size(), counters.cycles);
}

void WatchdogFeeder::Update(const Snapshot& snapshot, const CycleCounters& counters, double now_s) {
  ReportStalled(threads_.Check(now_s));
  const auto period_s = manager_.watchdog_period_s();
  if (!stalled_.empty() || !period_s || now_s - fed_s_ < *period_s) return;
  fed_s_ = now_s;
  manager_.NotifyWatchdog();
  if (now_s - status_s_ < kStatusPeriod_s) return;
  status_s_ = now_s;
  manager_.Status(StatusLine(snapshot, counters));
}

void WatchdogFeeder::ReportStalled(const ThreadWatchdog::StalledThread& stalled) {
  if (stalled.name == stalled_) return;
  stalled_ = stalled.name;
  if (stalled_.empty()) return;
  log::Log({log::Event::kThreadStalled,
            fmt::format("{} has not responded for {:.1f} s: {}", stalled_, stalled.silent_s,
                        manager_.watchdog_period_s() ? "the service manager will restart the daemon"
                                                     : "restart the daemon"),
            {{"THREAD", stalled_}}});
  manager_.RequestRestart();
}

constexpr int kReportPeriod_ms = 100, kPreparedPeriod_ms = 10;

/// The next signal, if one arrives within that time.
std::optional<int> AwaitSignal(int signals, int timeout_ms) {
  pollfd waiting{signals, POLLIN, 0};
  signalfd_siginfo info{};
  if (poll(&waiting, 1, timeout_ms) <= 0) return std::nullopt;
  if (read(signals, &info, sizeof info) != sizeof info) return std::nullopt;
  return static_cast<int>(info.ssi_signo);
}

void UpdateAffinity(Running& running, double now_s) {
  const CycleCounters counters = running.cycle.counters();
  const CycleParts& parts = running.cycle.parts();
  running.affinity.Update({counters.cycles, counters.overruns, parts.period_s},
                          {running.cycle.heartbeat().thread(), parts.link->heartbeat().thread()},
                          now_s);
}

void LogClockStep(service::UtcClock& clock, double now_s) {
  const auto step_s = clock.DetectStep(service::SystemUtcSeconds(), now_s);
  if (!step_s) return;
  log::Log({log::Event::kClockSet,
            fmt::format("system clock stepped by {:+.0f} s: probe and effect times continue on the "
                        "previous time base. Restart the daemon to use the new time",
                        *step_s)});
}

/// Logs transitions, reloads on SIGHUP and feeds the watchdog until SIGTERM or SIGINT.
/// @param signals  descriptor that SIGHUP, SIGTERM and SIGINT are read from
void Supervise(int signals, Running& running) {
  Reporter reporter(PointNames(running.started), log::Log);
  reporter.SetCell(running.started.machine.cell);
  Reloader reloader(running, reporter);
  WatchdogFeeder feeder(running.watchdog, running.manager);
  service::UtcClock clock = running.cycle.clock();
  for (;;) {
    const std::optional<int> signal =
        AwaitSignal(signals, reloader.pending() ? kPreparedPeriod_ms : kReportPeriod_ms);
    if (signal == SIGHUP) {
      reloader.Request();
    } else if (signal) {
      log::Log({log::Event::kEnding,
                fmt::format("stopping on {}", *signal == SIGTERM ? "SIGTERM" : "SIGINT")});
      running.manager.Stopping();
      return;
    }
    reloader.Poll();
    const double now_s = MonotonicSeconds();
    LogClockStep(clock, now_s);
    const std::uint16_t raised = running.cycle.TakeAlarms();
    {
      const auto snapshot = running.cycle.ReadSnapshot();
      reporter.Observe(*snapshot, raised, running.cycle.parts().link->Status());
      const auto& motion = running.cycle.parts().motion;
      reporter.ObserveMotion(motion ? motion->Status() : status::MotionLinkStatus(),
                             motion ? motion->problem() : "", now_s);
      feeder.Update(*snapshot, running.cycle.counters(), now_s);
      running.controller.Observe(*snapshot);
    }
    running.mailboxes.compensated_twice = running.controller.compensated_twice();
    UpdateAffinity(running, now_s);
    running.plc.DepositConnections(running.manager);
    running.display.PublishIfDue();
    log::FlushLog();
  }
}

int NotStarted(const std::string& config_file) {
  log::Log(
      {log::Event::kNotStarted,
       fmt::format("not started: fix the faults reported above in {} and in its state directory; "
                   "run `plumbline check` to verify",
                   config_file)});
  return 1;
}

/// Locks the state directory, or logs which daemon uses it.
bool Acquire(StateStorage& storage, const config::DaemonConfig& config) {
  const std::optional<std::string> other_daemon = storage.Acquire();
  if (!other_daemon) return true;
  const bool fatal = config.monitoring.enabled;
  log::Log({fatal ? log::Event::kNotStarted : log::Event::kStateDirectory,
            fmt::format("{}state directory: {}: {}; stop it, or give this daemon its own "
                        "state_directory{}",
                        fatal ? "not started: " : "", config.state_directory, *other_daemon,
                        fatal ? "" : "; otherwise `plumbline model` cannot notify it")});
  return false;
}

/// Records the path for `plumbline model apply`, which reports how far the configured points move.
void RecordConfiguration(const config::DaemonConfig& config) {
  if (const auto recorded = RecordConfigurationPath(config.state_directory, config.file);
      !recorded) {
    log::Log(
        {log::Event::kStateDirectory,
         fmt::format("state directory: {}; `plumbline model apply` does not know this daemon's "
                     "points unless it is given --config",
                     recorded.error())});
  }
}

std::unique_ptr<ViewPublisher> OpenView(const std::string& state_directory) {
  auto opened = ViewPublisher::Open(ViewSocketOf(state_directory));
  if (opened) return std::move(opened).value();
  log::Log({log::Event::kViewUnavailable, fmt::format("no display possible: {}", opened.error())});
  return nullptr;
}

void LogPushNotWithdrawn(const ControlCycle& cycle) {
  const robot::RobotLinkStatus robot = cycle.parts().link->Status();
  if (robot.push_result == robot::LinkResult::kOk) return;
  log::Log({log::Event::kPushNotWithdrawn,
            fmt::format("pushed points may still be marked valid in the controller: {}",
                        robot::LinkResultText(robot.push_result))});
}

}  // namespace

int RunDaemon(const std::string& config_file, const std::string& port_file) {
  // Per-thread malloc arenas would double the resident memory of a daemon that hardly allocates.
  mallopt(M_ARENA_MAX, 1);
  const int signals = service::OpenSignalDescriptor();
  service::ServiceManager manager;

  config::FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(config_file, faults);
  log::LogFaults(faults);
  if (!in_force) return NotStarted(config_file);
  const config::DaemonConfig* const config = &in_force->config;
  StateStorage storage(config->state_directory, log::Log);
  const bool owns_directory = Acquire(storage, *config);
  // Two writers of one journal would raise alarms for each other.
  if (!owns_directory && config->monitoring.enabled) return 2;

  if (owns_directory && storage.writable()) RecordConfiguration(*config);
  std::unique_ptr<CycleParts> parts = PartsFrom(*in_force, nullptr);
  if (!parts) return NotStarted(config_file);
  AwaitBranches(*parts);
  CycleMailboxes mailboxes;
  DisplayFeed display(OpenView(config->state_directory), mailboxes, config->vision.cameras.size());
  const auto cameras = CameraSupervisors::Open(*config, mailboxes, display);
  if (!cameras) {
    log::Log({log::Event::kNotStarted, cameras.error()});
    return 1;
  }
  const std::uint16_t boot_count = NextBootCount(config->state_directory);
  Latest<modbus::RegisterImage> images(1, FirstImage(*parts, boot_count));
  modbus::ImageHandler handler(images, EmptyCommandArea(), Identification());

  const auto plc = PlcServers::Open(config->plc, manager, handler);
  if (!plc) {
    log::Log({log::Event::kPlcServerFailed, fmt::format("PLC server: {}", plc.error())});
    return 2;
  }
  if (owns_directory) storage.StoreBootCount(boot_count);

  storage.OnWritable([&display, config] {
    display.Reopen([config] { return OpenView(config->state_directory); });
  });
  MonitoringWorker worker(
      mailboxes, log::Log, [] { kill(getpid(), SIGHUP); }, owns_directory ? &storage : nullptr);
  worker.Configure(*config, in_force->models);
  worker.Start();
  ControlCycle cycle(std::move(parts), handler, images, mailboxes, boot_count, &(*plc)->server());
  cycle.Start();
  display.Configure(*in_force);
  display.Start(cycle);
  GaugeWorker gauges(mailboxes.gauges, log::Log);
  gauges.Start(*config);
  (*cameras)->Start();
  log::Log({log::Event::kStarted,
            fmt::format("plumblined {} with {} ({} points), PLC server on {}:{}", PLUMBLINE_VERSION,
                        config->machine.cell.robot.name, config->machine.points.size(),
                        config->plc.tcp.address, (*plc)->server().port())});
  LogModel(*in_force);
  if (!port_file.empty()) {
    if (const auto written = os::WritePortFile(port_file, {{"plc", (*plc)->server().port()}});
        !written) {
      log::Log({log::Event::kFileWarning, written.error()});
    }
  }
  malloc_trim(0);
  Running running{config_file,
                  *config,
                  cycle,
                  worker,
                  display,
                  gauges,
                  **plc,
                  manager,
                  {},
                  RobotTimeout_s(*config),
                  RunningDaemon{config->state_directory, in_force->models, owns_directory},
                  mailboxes};
  running.controller.Configure(*config);
  AddThreads(*config, cycle, worker, gauges, running.watchdog);
  (*cameras)->AddTo(running.watchdog);
  (*plc)->AddTo(running.watchdog);
  manager.Ready("started");
  Supervise(signals, running);
  (*cameras)->Stop();
  gauges.Stop();
  cycle.Stop();
  worker.Stop();
  LogPushNotWithdrawn(cycle);
  (*plc)->DepositConnections(manager);  // including those that connected during the shutdown
  log::FlushLog(true);
  return 0;
}

}  // namespace plumbline::cell
