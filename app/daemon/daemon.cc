#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "app/daemon/boot_counter.h"
#include "app/daemon/camera_supervisors.h"
#include "app/daemon/control_cycle.h"
#include "app/daemon/cycle_affinity.h"
#include "app/daemon/device_wait.h"
#include "app/daemon/display_feed.h"
#include "app/daemon/gauge_worker.h"
#include "app/daemon/model_in_force.h"
#include "app/daemon/monitoring_worker.h"
#include "app/daemon/plc_servers.h"
#include "app/daemon/reporter.h"
#include "app/daemon/state_storage.h"
#include "app/daemon/thread_watchdog.h"
#include "app/log/fault_log.h"
#include "app/log/log.h"
#include "app/model_store/configuration_note.h"
#include "app/model_store/usable_model.h"
#include "app/service/service_manager.h"
#include "app/service/signals.h"
#include "app/version.h"
#include "drivers/robot/host_name.h"

namespace plumbline::daemon {
namespace {

constexpr int kReportPeriod_ms = 100, kPreparedPeriod_ms = 10;
/// A newer reload replaces a pending one, but not for longer than this: otherwise frequent reloads
/// would postpone the new points forever.
constexpr double kMaxPostponed_s = 10;
constexpr char kRobotLink[] = "robot link";
/// How long the start waits for the branches of taught points: enough for ordinary cells, while the
/// PLC server of a cell with many points opens without them.
constexpr double kBranchesTimeout_s = 0.3;

/// Watchdog timeouts of the threads. The monitoring worker may wait for another program's lock on
/// the journal; the robot thread for a name server, if the controller is configured by name.
constexpr double kThreadTimeout_s = 2, kMonitoringTimeout_s = 5.5, kNameLookupTimeout_s = 60;

/// Watchdog timeout of the robot link: pushing one point takes seven requests, each of which may
/// take nearly its own timeout.
double RobotTimeout_s(const config::DaemonConfig& config) {
  constexpr double kRequestsPerPush = 7;
  if (config.robot.transport == "tcp" && !robot::IsAddress(config.robot.connection.tcp.host)) {
    return kNameLookupTimeout_s;
  }
  return kThreadTimeout_s + kRequestsPerPush * config.robot.connection.timeout_s;
}

/// @param in_use  the present parts, whose robot link is reused if its settings have not changed;
///                nullptr at the start
std::unique_ptr<CycleParts> PartsFrom(const ConfigInForce& in_force, const CycleParts* in_use) {
  const config::DaemonConfig& config = in_force.config;
  if (const auto why_not = model_store::ModelUnusableReason(config.machine.cell)) {
    log::Log({log::Event::kFileFault, fmt::format("{}: {}; fix or remove that effect in this file",
                                                  config.cell_file, *why_not)});
    return nullptr;
  }
  const auto refuse = [](const std::string& why) {
    log::Log({log::Event::kRobotSetupFailed, fmt::format("robot: {}", why)});
    return nullptr;
  };
  Result<RobotSetup> robot = RobotSetupFrom(config);
  if (!robot) return refuse(robot.error());
  std::shared_ptr<robot::RobotLink> link;
  if (in_use != nullptr && in_use->robot == *robot) {
    link = in_use->link;
  } else {
    Result<std::unique_ptr<robot::RobotDevice>> device =
        robot::MakeRobot(robot->transport, robot->connection);
    if (!device) return refuse(device.error());
    link = std::make_shared<robot::RobotLink>(std::move(device).value());
  }
  auto parts = std::make_unique<CycleParts>(config, std::move(link), in_force.models.applied);
  parts->robot = std::move(robot).value();
  parts->model_superseded = !in_force.set_aside.empty();
  return parts;
}

void AwaitBranches(CycleParts& parts) {
  const double until_s = MonotonicSeconds() + kBranchesTimeout_s;
  while (!parts.branches.finished() && MonotonicSeconds() < until_s) SleepSeconds(0.002);
  parts.branches.DeliverTo(parts.machine, parts.machine.config().points.size());
}

void LogModel(const ConfigInForce& in_force) {
  const model_store::ModelState& models = in_force.models;
  log::SetLogContext({in_force.config.machine.cell.robot.name, models.applied});
  if (!in_force.set_aside.empty()) log::Log({log::Event::kModelSetAside, in_force.set_aside});
  if (models.applied == models.declared) return;
  log::Log({log::Event::kModelInForce,
            fmt::format("model version {} in force in place of the cell file", models.applied)});
}

std::vector<Reporter::PointName> PointNames(const config::DaemonConfig& config) {
  std::vector<Reporter::PointName> names;
  for (const correction::AssemblyPoint& point : config.machine.points)
    names.push_back({point.id, point.name});
  return names;
}

/// Records the path for `plumbline model apply`, which reports how far the configured points move.
void RecordConfiguration(const config::DaemonConfig& config) {
  if (const auto recorded =
          model_store::RecordConfigurationPath(config.state_directory, config.file);
      !recorded) {
    log::Log(
        {log::Event::kStateDirectory,
         fmt::format("state directory: {}; `plumbline model apply` does not know this daemon's "
                     "points unless it is given --config",
                     recorded.error())});
  }
}

/// The running parts of the daemon.
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

/// A reloaded configuration whose point branches are still being searched; the previous one remains
/// in force until then.
struct PendingReload {
  ConfigInForce in_force;
  std::unique_ptr<CycleParts> parts;
};

std::optional<PendingReload> ReadConfiguration(const Running& running) {
  const std::string& file = running.file;
  config::FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(file, faults, running.state);
  const std::size_t served = running.cycle.parts().machine.config().points.size();
  if (in_force && served > 0 && in_force->config.machine.points.empty()) {
    faults.Add({.file = file,
                .key = "point",
                .what = fmt::format("the file has no [[point]], but {} points are in force: it may "
                                    "be truncated. Restore it, or restart the daemon to run "
                                    "without points",
                                    served)});
    in_force.reset();
  }
  log::LogFaults(faults);
  // The cameras are those of the start until a restart, and so is what requires them.
  if (in_force) {
    in_force->config.machine.required_lenses = running.started.machine.required_lenses;
  }
  std::unique_ptr<CycleParts> parts =
      in_force ? PartsFrom(*in_force, &running.cycle.parts()) : nullptr;
  if (!parts) {
    log::Log({log::Event::kNotReloaded,
              "Configuration not reloaded; the previous one stays in force. Fix the faults "
              "reported above, then reload."});
    return std::nullopt;
  }
  return PendingReload{std::move(*in_force), std::move(parts)};
}

void Reload(PendingReload pending, Running& running, Reporter& reporter) {
  const config::DaemonConfig& started = running.started;
  const ConfigInForce* const in_force = &pending.in_force;
  const config::DaemonConfig& fresh = in_force->config;
  if (PlcServersDiffer(fresh.plc, started.plc)) {
    log::Log(
        {log::Event::kNeedsRestart,
         "needs a restart: plc.listen, port, unit_id, max_clients, allow or [plc.rtu] differs from "
         "what the daemon started with"});
  }
  if (CamerasDiffer(fresh, started)) {
    log::Log(
        {log::Event::kNeedsRestart,
         "needs a restart: [camera], [zoom], [board], [tags] or the tags' file differs from what "
         "the daemon started with"});
  }
  if (in_force->configured_state_directory != started.state_directory) {
    log::Log({log::Event::kNeedsRestart,
              fmt::format("needs a restart: state_directory changed, {} stays in use",
                          started.state_directory)});
  }
  const bool other_gauges = GaugesDiffer(fresh, running.gauges.config());
  if (other_gauges) running.gauges.Stop();  // its artefact numbers are those of the old cell
  running.worker.Configure(fresh,
                           in_force->models);  // before the new machine's first probe arrives
  const bool link_kept = pending.parts->link == running.cycle.parts().link;
  // The old link may have a reading in progress, and withdraws the points it has pushed.
  const double start_s = MonotonicSeconds();
  double fed_s = start_s;
  pending.parts->branches.DeliverTo(pending.parts->machine, fresh.machine.points.size());
  running.cycle.Replace(std::move(pending.parts), [&] {
    running.plc.DepositConnections(running.manager);
    const double now_s = MonotonicSeconds();
    const auto period_s = running.manager.watchdog_period_s();
    if (!period_s || now_s - fed_s < *period_s) return;
    if (now_s - start_s > running.robot_timeout_s + robot::kWithdrawal_s) return;
    fed_s = now_s;
    running.manager.NotifyWatchdog();
  });
  if (other_gauges) running.gauges.Start(fresh);
  running.display.Configure(fresh);
  running.state.models = in_force->models;
  running.robot_timeout_s = RobotTimeout_s(fresh);
  running.watchdog.SetTimeout(kRobotLink, running.robot_timeout_s);
  reporter.Configure(PointNames(fresh), link_kept);
  log::Log({log::Event::kReloaded, fmt::format("configuration {} reloaded", running.file)});
  LogModel(*in_force);
}

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

/// Feeds the service manager's watchdog while every thread is responsive.
class WatchdogFeeder {
 public:
  void Update(Running& running, const Snapshot& snapshot, double now_s) {
    const ThreadWatchdog::StalledThread stalled = running.watchdog.Check(now_s);
    if (stalled.name != stalled_) {
      stalled_ = stalled.name;
      if (!stalled_.empty()) {
        log::Log({log::Event::kThreadStalled,
                  fmt::format("{} has not responded for {:.1f} s: {}", stalled_, stalled.silent_s,
                              running.manager.watchdog_period_s()
                                  ? "the service manager will restart the daemon"
                                  : "restart the daemon"),
                  {{"THREAD", stalled_}}});
        running.manager.RequestRestart();
      }
    }
    const auto period_s = running.manager.watchdog_period_s();
    if (!stalled_.empty() || !period_s || now_s - fed_s_ < *period_s) return;
    fed_s_ = now_s;
    running.manager.NotifyWatchdog();
    if (now_s - status_s_ < kStatusPeriod_s) return;
    status_s_ = now_s;
    running.manager.Status(StatusLine(snapshot, running.cycle.counters()));
  }

 private:
  static constexpr double kStatusPeriod_s = 5;
  std::string stalled_;  ///< the thread that was logged as stalled; empty: none
  double fed_s_ = -1e300, status_s_ = -1e300;
};

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

void UpdateAffinity(Running& running, double now_s) {
  const CycleCounters counters = running.cycle.counters();
  const CycleParts& parts = running.cycle.parts();
  running.affinity.Update({counters.cycles, counters.overruns, parts.period_s},
                          {running.cycle.heartbeat().thread(), parts.link->heartbeat().thread()},
                          now_s);
}

/// The main thread's loop: logs transitions, reloads and feeds the watchdog until a signal stops
/// the daemon.
void Supervise(int signals, Running& running) {
  Reporter reporter(PointNames(running.started), log::Log);
  service::UtcClock clock = running.cycle.clock();
  WatchdogFeeder feeder;
  std::optional<PendingReload> pending;
  double pending_since_s = 0;  // time of the first signal that it serves
  bool reread = false;         // another signal came, and the pending reload goes first
  const auto reloaded = [&running] { running.manager.Ready("configuration reloaded"); };
  for (;;) {
    pollfd waiting{signals, POLLIN, 0};
    if (poll(&waiting, 1, pending ? kPreparedPeriod_ms : kReportPeriod_ms) > 0) {
      signalfd_siginfo info{};
      if (read(signals, &info, sizeof info) != sizeof info) continue;
      if (info.ssi_signo != SIGHUP) {
        log::Log({log::Event::kEnding,
                  fmt::format("stopping on {}", info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT")});
        running.manager.Stopping();
        return;
      }
      running.manager.Reloading();
      if (!pending) pending_since_s = MonotonicSeconds();
      // The newer file replaces the pending one, unless that has waited for too long.
      reread = pending && MonotonicSeconds() - pending_since_s > kMaxPostponed_s;
      if (!reread) {
        pending.reset();
        pending = ReadConfiguration(running);
        if (!pending) reloaded();
      }
    }
    if (pending && pending->parts->branches.finished()) {
      Reload(std::move(*pending), running, reporter);
      pending.reset();
      if (reread) {
        reread = false;
        pending_since_s = MonotonicSeconds();
        pending = ReadConfiguration(running);
      }
      if (!pending) reloaded();
    }
    const double now_s = MonotonicSeconds();
    if (const auto step_s = clock.DetectStep(service::SystemUtcSeconds(), now_s)) {
      log::Log(
          {log::Event::kClockSet,
           fmt::format("system clock stepped by {:+.0f} s: probe and effect times continue on the "
                       "previous time base. Restart the daemon to use the new time",
                       *step_s)});
    }
    const std::uint16_t raised = running.cycle.TakeAlarms();
    {
      const auto snapshot = running.cycle.ReadSnapshot();
      reporter.Observe(*snapshot, raised, running.cycle.parts().link->Status());
      feeder.Update(running, *snapshot, now_s);
    }
    UpdateAffinity(running, now_s);
    running.plc.DepositConnections(running.manager);
    running.display.PublishIfDue();
    log::FlushLog();
  }
}

std::unique_ptr<view_link::ViewPublisher> OpenView(const std::string& state_directory) {
  auto opened = view_link::ViewPublisher::Open(view_link::ViewSocketOf(state_directory));
  if (opened) return std::move(opened).value();
  log::Log({log::Event::kViewUnavailable, fmt::format("no display possible: {}", opened.error())});
  return nullptr;
}

}  // namespace

int RunDaemon(const std::string& config_file) {
  // Per-thread malloc arenas would double the resident memory of a daemon that hardly allocates.
  mallopt(M_ARENA_MAX, 1);
  const int signals = service::OpenSignalDescriptor();
  service::ServiceManager manager;

  config::FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(config_file, faults);
  log::LogFaults(faults);
  const auto not_started = [&config_file] {
    log::Log(
        {log::Event::kNotStarted,
         fmt::format("not started: fix the faults reported above in {} and in its state directory; "
                     "run `plumbline check` to verify",
                     config_file)});
    return 1;
  };
  if (!in_force) return not_started();
  const config::DaemonConfig* const config = &in_force->config;
  StateStorage storage(config->state_directory, log::Log);
  const std::optional<std::string> other_daemon = storage.Acquire();
  if (other_daemon) {
    log::Log(
        {config->monitoring.enabled ? log::Event::kNotStarted : log::Event::kStateDirectory,
         fmt::format(
             "{}state directory: {}: {}; stop it, or give this daemon its own "
             "state_directory{}",
             config->monitoring.enabled ? "not started: " : "", config->state_directory,
             *other_daemon,
             config->monitoring.enabled ? "" : "; otherwise `plumbline model` cannot notify it")});
    if (config->monitoring.enabled)
      return 2;  // two writers of one journal would raise alarms for each other
  }

  if (!other_daemon && storage.writable()) RecordConfiguration(*config);
  std::unique_ptr<CycleParts> parts = PartsFrom(*in_force, nullptr);
  if (!parts) return not_started();
  AwaitBranches(*parts);
  CycleMailboxes mailboxes;
  DisplayFeed display(OpenView(config->state_directory), mailboxes, config->vision.cameras.size());
  const auto cameras = CameraSupervisors::Open(*config, mailboxes, display);
  if (!cameras) {
    log::Log({log::Event::kNotStarted, cameras.error()});
    return 1;
  }
  const std::uint16_t boot_count = NextBootCount(config->state_directory);
  // Clients that read before the first cycle find the register map complete: they see the identity
  // of this start and the points, none of them valid.
  modbus::RegisterImage first_image;
  first_image.readable = parts->readable;
  MachineInput nothing;
  nothing.background_warnings =
      parts->model_superseded ? warning::kModelSetAside : std::uint16_t{0};
  first_image.registers = parts->encoder.Encode(parts->machine.Cycle(nothing),
                                                EnvironmentAtStart(boot_count, parts->period_s));
  first_image.bits.resize(plc::registers::kBits);
  Latest<modbus::RegisterImage> images(1, first_image);
  modbus::ImageHandler handler(images, EmptyCommandArea(), Identification());

  const auto plc = PlcServers::Open(config->plc, manager, handler);
  if (!plc) {
    log::Log({log::Event::kPlcServerFailed, fmt::format("PLC server: {}", plc.error())});
    return 2;
  }
  if (!other_daemon) storage.StoreBootCount(boot_count);

  storage.OnWritable([&display, config] {
    display.Reopen([config] { return OpenView(config->state_directory); });
  });
  MonitoringWorker worker(
      mailboxes, log::Log, [] { kill(getpid(), SIGHUP); }, other_daemon ? nullptr : &storage);
  worker.Configure(*config, in_force->models);
  worker.Start();
  ControlCycle cycle(std::move(parts), handler, images, mailboxes, boot_count, &(*plc)->server());
  cycle.Start();
  display.Configure(*config);
  display.Start(cycle);
  GaugeWorker gauges(mailboxes.gauges, log::Log);
  gauges.Start(*config);
  (*cameras)->Start();
  log::Log({log::Event::kStarted,
            fmt::format("plumblined {} with {} ({} points), PLC server on {}:{}", PLUMBLINE_VERSION,
                        config->machine.cell.robot.name, config->machine.points.size(),
                        config->plc.tcp.address, (*plc)->server().port())});
  LogModel(*in_force);
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
                  RunningDaemon{config->state_directory, in_force->models, !other_daemon}};
  AddThreads(*config, cycle, worker, gauges, running.watchdog);
  (*cameras)->AddTo(running.watchdog);
  (*plc)->AddTo(running.watchdog);
  manager.Ready("started");
  Supervise(signals, running);
  (*cameras)->Stop();
  gauges.Stop();
  cycle.Stop();
  worker.Stop();
  if (const robot::RobotLinkStatus robot = cycle.parts().link->Status();
      robot.push_result != robot::LinkResult::kOk) {
    log::Log({log::Event::kPushNotWithdrawn,
              fmt::format("pushed points may still be marked valid in the controller: {}",
                          robot::LinkResultText(robot.push_result))});
  }
  (*plc)->DepositConnections(manager);  // including those that connected during the shutdown
  log::FlushLog(true);
  return 0;
}

}  // namespace plumbline::daemon
