#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "app/daemon/boot_counter.h"
#include "app/daemon/camera_side.h"
#include "app/daemon/cyclic_loop.h"
#include "app/daemon/device_wait.h"
#include "app/daemon/lifeline.h"
#include "app/daemon/loop_worker.h"
#include "app/daemon/model_in_force.h"
#include "app/daemon/one_processor.h"
#include "app/daemon/plc_side.h"
#include "app/daemon/reporter.h"
#include "app/daemon/state_storage.h"
#include "app/daemon/view_side.h"
#include "app/log/fault_log.h"
#include "app/log/log.h"
#include "app/model_store/configuration_note.h"
#include "app/model_store/usable_model.h"
#include "app/service/service_manager.h"
#include "app/service/signals.h"
#include "app/version.h"
#include "drivers/robot/host_name.h"

namespace plumbline {
namespace {

constexpr int kReportPeriod_ms = 100, kPreparedPeriod_ms = 10;
/// Reloads that follow one another put off the points of none of them for longer.
constexpr double kLongestPostponed_s = 10;
constexpr char kRobotLink[] = "robot link";
/// Ordinary cells have all branches before anybody can ask; the port of a large one does not wait.
constexpr double kBranchesFirst_s = 0.3;

/// For how long a thread may do one thing. The journal's may wait for another program's lock on it,
/// the robot's for a name server where it is given by name.
constexpr double kPatience_s = 2, kJournalPatience_s = 5.5, kNamePatience_s = 60;

/// Of the robot link: one point pushed is seven requests, and each may take nearly its time-out.
double RobotPatience_s(const DaemonConfig& config) {
  constexpr double kRequestsInARow = 7;
  if (config.robot.transport == "tcp" && !IsAddress(config.robot.connection.tcp.host)) {
    return kNamePatience_s;
  }
  return kPatience_s + kRequestsInARow * config.robot.connection.timeout_s;
}

/// @param in_use  the parts in force, whose robot link goes on where nothing of it changed; nullptr
///                at the start
std::unique_ptr<CycleParts> PartsFrom(const ConfigInForce& in_force, const CycleParts* in_use) {
  const DaemonConfig& config = in_force.config;
  if (const auto why_not = WhyNotUsable(config.machine.cell)) {
    Log({Event::kFileFault, fmt::format("{}: {}; fix or remove that effect in this file",
                                        config.cell_file, *why_not)});
    return nullptr;
  }
  const auto refuse = [](const std::string& why) {
    Log({Event::kRobotSetUp, fmt::format("robot: {}", why)});
    return nullptr;
  };
  Result<RobotSetUp> robot = RobotSetUpOf(config);
  if (!robot) return refuse(robot.error());
  std::shared_ptr<RobotLink> link;
  if (in_use != nullptr && in_use->robot == *robot) {
    link = in_use->link;
  } else {
    Result<std::unique_ptr<RobotDevice>> device = MakeRobot(robot->transport, robot->connection);
    if (!device) return refuse(device.error());
    link = std::make_shared<RobotLink>(std::move(device).value());
  }
  auto parts = std::make_unique<CycleParts>(config, std::move(link), in_force.models.applied);
  parts->robot = std::move(robot).value();
  parts->model_set_aside = !in_force.set_aside.empty();
  return parts;
}

void AwaitBranches(CycleParts& parts) {
  const double until_s = MonotonicSeconds() + kBranchesFirst_s;
  while (!parts.branches.finished() && MonotonicSeconds() < until_s) SleepSeconds(0.002);
  parts.branches.HandTo(parts.machine, parts.machine.config().points.size());
}

void TellModel(const ConfigInForce& in_force) {
  const ModelState& models = in_force.models;
  SetLogContext({in_force.config.machine.cell.robot.name, models.applied});
  if (!in_force.set_aside.empty()) Log({Event::kModelSetAside, in_force.set_aside});
  if (models.applied == models.declared) return;
  Log({Event::kModelInForce,
       fmt::format("model version {} in force in place of the cell file", models.applied)});
}

std::vector<Reporter::PointName> PointNames(const DaemonConfig& config) {
  std::vector<Reporter::PointName> names;
  for (const AssemblyPoint& point : config.machine.points) names.push_back({point.id, point.name});
  return names;
}

/// For `plumbline model apply`, which says by how much these points move.
void NoteConfigurationOf(const DaemonConfig& config) {
  if (const auto noted = NoteConfiguration(config.state_directory, config.file); !noted) {
    Log({Event::kStateDirectory,
         fmt::format("state directory: {}; `plumbline model apply` does not know this daemon's "
                     "points unless it is given --config",
                     noted.error())});
  }
}

/// What runs until a signal ends it.
struct Running {
  const std::string& file;  ///< of the configuration
  const DaemonConfig& started;
  CyclicLoop& loop;
  LoopWorker& worker;
  ViewSide& view;
  PlcSide& plc;
  const ServiceManager& manager;
  Lifeline lifeline;
  double robot_patience_s;  ///< of the link in force
  DaemonAtWork at_work;
  OneProcessor processor{};
};

/// A configuration that was read again, while the branches of its points are searched: until then
/// the old one is served.
struct PendingReload {
  ConfigInForce in_force;
  std::unique_ptr<CycleParts> parts;
};

std::optional<PendingReload> ReadAgain(const Running& running) {
  const std::string& file = running.file;
  FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(file, faults, running.at_work);
  const std::size_t served = running.loop.parts().machine.config().points.size();
  if (in_force && served > 0 && in_force->config.machine.points.empty()) {
    faults.Add({.file = file,
                .key = "point",
                .what = fmt::format("the file has no [[point]], but {} points are in force: it may "
                                    "be truncated. Restore it, or restart the daemon to run "
                                    "without points",
                                    served)});
    in_force.reset();
  }
  LogFaults(faults);
  std::unique_ptr<CycleParts> parts =
      in_force ? PartsFrom(*in_force, &running.loop.parts()) : nullptr;
  if (!parts) {
    Log({Event::kNotReloaded,
         "Configuration not reloaded; the previous one stays in force. Fix the faults "
         "reported above, then reload."});
    return std::nullopt;
  }
  return PendingReload{std::move(*in_force), std::move(parts)};
}

void Reload(PendingReload pending, Running& running, Reporter& reporter) {
  const DaemonConfig& started = running.started;
  const ConfigInForce* const in_force = &pending.in_force;
  const DaemonConfig& fresh = in_force->config;
  if (PlcSideDiffers(fresh.plc, started.plc)) {
    Log({Event::kNeedsRestart,
         "needs a restart: plc.listen, port, unit_id, max_clients, allow or [plc.rtu] differs from "
         "what the daemon started with"});
  }
  if (CameraDiffers(fresh, started)) {
    Log({Event::kNeedsRestart,
         "needs a restart: [camera], [zoom], [board], [tags] or the tags' file differs from what "
         "the daemon started with"});
  }
  if (in_force->asked_state_directory != started.state_directory) {
    Log({Event::kNeedsRestart,
         fmt::format("needs a restart: state_directory, in force is {}", started.state_directory)});
  }
  running.worker.Configure(fresh,
                           in_force->models);  // first: it judges the new machine's first probe too
  const bool link_kept = pending.parts->link == running.loop.parts().link;
  // An old link may have a reading under way, and withdraws what it pushed.
  const double begin_s = MonotonicSeconds();
  double fed_s = begin_s;
  pending.parts->branches.HandTo(pending.parts->machine, fresh.machine.points.size());
  running.loop.Replace(std::move(pending.parts), [&] {
    running.plc.KeepConnections(running.manager);
    const double now_s = MonotonicSeconds();
    const auto period_s = running.manager.feed_period_s();
    if (!period_s || now_s - fed_s < *period_s) return;
    if (now_s - begin_s > running.robot_patience_s + kWithdrawal_s) return;
    fed_s = now_s;
    running.manager.NotifyWatchdog();
  });
  running.view.Configure(fresh);
  running.at_work.models = in_force->models;
  running.robot_patience_s = RobotPatience_s(fresh);
  running.lifeline.SetPatience(kRobotLink, running.robot_patience_s);
  reporter.Configure(PointNames(fresh), link_kept);
  Log({Event::kReloaded, fmt::format("configuration {} reloaded", running.file)});
  TellModel(*in_force);
}

/// One line for `systemctl status`, with what anybody would ask first.
std::string StatusLine(const Snapshot& snapshot, const LoopCounters& counters) {
  const auto valid = std::count_if(snapshot.points.begin(), snapshot.points.end(),
                                   [](const PointResult& point) { return point.valid; });
  return fmt::format(
      "{}: {}; {}, {} of {} points valid, cycle {}", Describe(snapshot.health.severity),
      snapshot.health.reason == HealthReason::kNone ? "no complaint"
                                                    : Describe(snapshot.health.reason),
      (snapshot.status & status::kRobotLink) != 0 ? "robot trusted" : "no robot", valid,
      snapshot.points.size(), counters.cycles);
}

/// Feeds the service manager's watchdog as long as every thread comes round.
class Watchdog {
 public:
  void Look(Running& running, const Snapshot& snapshot, double now_s) {
    const Lifeline::Standing standing = running.lifeline.Look(now_s);
    if (standing.thread != told_) {
      told_ = standing.thread;
      if (!told_.empty()) {
        Log({Event::kStandsStill,
             fmt::format("{} stands still since {:.1f} s{}", told_, standing.for_s,
                         running.manager.feed_period_s() ? ": the service manager will restart"
                                                         : ": restart the daemon"),
             {{"THREAD", told_}}});
        running.manager.AskForRestart();
      }
    }
    const auto period_s = running.manager.feed_period_s();
    if (!told_.empty() || !period_s || now_s - fed_s_ < *period_s) return;
    fed_s_ = now_s;
    running.manager.NotifyWatchdog();
    if (now_s - status_s_ < kStatusPeriod_s) return;
    status_s_ = now_s;
    running.manager.Status(StatusLine(snapshot, running.loop.counters()));
  }

 private:
  static constexpr double kStatusPeriod_s = 5;
  std::string told_;  ///< the thread that was told to stand still
  double fed_s_ = -1e300, status_s_ = -1e300;
};

void AddThreads(const DaemonConfig& config, const CyclicLoop& loop, const LoopWorker& worker,
                Lifeline& lifeline) {
  lifeline.Add("cycle", kPatience_s, [&loop] { return loop.pulse().beats(); });
  lifeline.Add(
      kRobotLink, RobotPatience_s(config), [&loop] { return loop.parts().link->pulse().beats(); },
      [&loop] { return WaitsForDevice(loop.parts().link->pulse().thread()); });
  lifeline.Add(
      "journal and diagnosis", kJournalPatience_s, [&worker] { return worker.pulse().beats(); },
      [&worker] { return WaitsForDevice(worker.pulse().thread()); });
}

void KeepTogether(Running& running, double now_s) {
  const LoopCounters counters = running.loop.counters();
  const CycleParts& parts = running.loop.parts();
  running.processor.Look({counters.cycles, counters.overruns, parts.period_s},
                         {running.loop.pulse().thread(), parts.link->pulse().thread()}, now_s);
}

/// Tells transitions until a signal ends the daemon.
void Watch(int signals, Running& running) {
  Reporter reporter(PointNames(running.started), Log);
  UtcClock clock = running.loop.clock();
  Watchdog watchdog;
  std::optional<PendingReload> pending;
  double pending_since_s = 0;  // of the first signal that it answers
  bool read_again = false;     // a signal came, and the pending one goes first
  const auto reloaded = [&running] { running.manager.Ready("configuration read again"); };
  for (;;) {
    pollfd waiting{signals, POLLIN, 0};
    if (poll(&waiting, 1, pending ? kPreparedPeriod_ms : kReportPeriod_ms) > 0) {
      signalfd_siginfo info{};
      if (read(signals, &info, sizeof info) != sizeof info) continue;
      if (info.ssi_signo != SIGHUP) {
        Log({Event::kEnding,
             fmt::format("ending on {}", info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT")});
        running.manager.Stopping();
        return;
      }
      running.manager.Reloading();
      if (!pending) pending_since_s = MonotonicSeconds();
      // A file that has changed since takes the pending one's place, but not for ever.
      read_again = pending && MonotonicSeconds() - pending_since_s > kLongestPostponed_s;
      if (!read_again) {
        pending.reset();
        pending = ReadAgain(running);
        if (!pending) reloaded();
      }
    }
    if (pending && pending->parts->branches.finished()) {
      Reload(std::move(*pending), running, reporter);
      pending.reset();
      if (read_again) {
        read_again = false;
        pending_since_s = MonotonicSeconds();
        pending = ReadAgain(running);
      }
      if (!pending) reloaded();
    }
    const double now_s = MonotonicSeconds();
    if (const auto step_s = clock.NewStep(ComputerUtcSeconds(), now_s)) {
      Log({Event::kClockSet,
           fmt::format("the computer's clock was set by {:+.0f} s: times of probes and of effects "
                       "go on as before; a restart takes it up",
                       *step_s)});
    }
    const std::uint16_t raised = running.loop.TakeAlarms();
    {
      const auto snapshot = running.loop.ReadSnapshot();
      reporter.Observe(*snapshot, raised, running.loop.parts().link->Status());
      watchdog.Look(running, *snapshot, now_s);
    }
    KeepTogether(running, now_s);
    running.plc.KeepConnections(running.manager);
    running.view.TakeTime();
    LogRepeats();
  }
}

std::unique_ptr<ViewPublisher> OpenView(const std::string& state_directory) {
  auto opened = ViewPublisher::Open(ViewSocketOf(state_directory));
  if (opened) return std::move(opened).value();
  Log({Event::kViewUnavailable,
       fmt::format("nothing can be shown on a monitor: {}", opened.error())});
  return nullptr;
}

}  // namespace

int RunDaemon(const std::string& config_file) {
  // Threads' allocation arenas would double the resident memory of a daemon that hardly allocates.
  mallopt(M_ARENA_MAX, 1);
  const int signals = OpenSignals();
  ServiceManager manager;

  FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(config_file, faults);
  LogFaults(faults);
  const auto not_started = [&config_file] {
    Log({Event::kNotStarted,
         fmt::format("not started: fix the faults reported above in {} and in its state directory; "
                     "run `plumbline check` to verify",
                     config_file)});
    return 1;
  };
  if (!in_force) return not_started();
  const DaemonConfig* const config = &in_force->config;
  StateStorage storage(config->state_directory, Log);
  const std::optional<std::string> taken = storage.Take();
  if (taken) {
    Log({config->loop.enabled ? Event::kNotStarted : Event::kStateDirectory,
         fmt::format("{}state directory: {}: {}; end it, or give this daemon a state_directory of "
                     "its own{}",
                     config->loop.enabled ? "not started: " : "", config->state_directory, *taken,
                     config->loop.enabled ? "" : ", else `plumbline model` cannot notify it")});
    if (config->loop.enabled) return 2;  // two writers of one journal would alarm for each other
  }

  if (!taken && storage.works()) NoteConfigurationOf(*config);
  std::unique_ptr<CycleParts> parts = PartsFrom(*in_force, nullptr);
  if (!parts) return not_started();
  AwaitBranches(*parts);
  LoopLink link;
  ViewSide view(OpenView(config->state_directory), link, config->vision.cameras.size());
  const auto cameras = CameraSide::Open(*config, link, view);
  if (!cameras) {
    Log({Event::kNotStarted, cameras.error()});
    return 1;
  }
  const std::uint16_t boot_count = NextBootCount(config->state_directory);
  // Whoever asks before the first cycle, or has asked before this start, finds the map's form and
  // what this start is: numbers of points, none of them valid.
  modbus::RegisterImage first_image;
  first_image.readable = parts->readable;
  MachineInput nothing;
  nothing.loop_warnings = parts->model_set_aside ? warning::kModelSetAside : std::uint16_t{0};
  first_image.registers = parts->encoder.Encode(parts->machine.Cycle(nothing),
                                                EnvironmentAtStart(boot_count, parts->period_s));
  first_image.bits.resize(plc_map::kBits);
  Latest<modbus::RegisterImage> images(1, first_image);
  modbus::ImageHandler handler(images, EmptyCommandArea(), Identification());

  const auto plc = PlcSide::Open(config->plc, manager, handler);
  if (!plc) {
    Log({Event::kPlcSide, fmt::format("PLC side: {}", plc.error())});
    return 2;
  }
  if (!taken) storage.KeepBootCount(boot_count);

  storage.OnWorks(
      [&view, config] { view.OpenAgain([config] { return OpenView(config->state_directory); }); });
  LoopWorker worker(
      link, Log, [] { kill(getpid(), SIGHUP); }, taken ? nullptr : &storage);
  worker.Configure(*config, in_force->models);
  worker.Start();
  CyclicLoop loop(std::move(parts), handler, images, link, boot_count, &(*plc)->server());
  loop.Start();
  view.Configure(*config);
  view.Start(loop);
  (*cameras)->Start();
  Log({Event::kStarted,
       fmt::format("plumblined {} with {} ({} points), PLC side on {}:{}", PLUMBLINE_VERSION,
                   config->machine.cell.robot.name, config->machine.points.size(),
                   config->plc.tcp.address, (*plc)->server().port())});
  TellModel(*in_force);
  malloc_trim(0);
  Running running{config_file,
                  *config,
                  loop,
                  worker,
                  view,
                  **plc,
                  manager,
                  {},
                  RobotPatience_s(*config),
                  DaemonAtWork{config->state_directory, in_force->models, !taken}};
  AddThreads(*config, loop, worker, running.lifeline);
  (*cameras)->AddTo(running.lifeline);
  (*plc)->AddTo(running.lifeline);
  manager.Ready("started");
  Watch(signals, running);
  (*cameras)->Stop();
  loop.Stop();
  worker.Stop();
  if (const RobotLinkStatus robot = loop.parts().link->Status();
      robot.push_result != LinkResult::kOk) {
    Log({Event::kPushLeft, fmt::format("pushed points may still stand in the controller: {}",
                                       LinkResultText(robot.push_result))});
  }
  (*plc)->KeepConnections(manager);  // of those, too, that came while the others ended
  LogRepeats(true);
  return 0;
}

}  // namespace plumbline
