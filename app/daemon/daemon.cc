#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <mutex>

#include "app/daemon/boot_counter.h"
#include "app/daemon/camera_side.h"
#include "app/daemon/cyclic_loop.h"
#include "app/daemon/loop_worker.h"
#include "app/daemon/model_in_force.h"
#include "app/daemon/reporter.h"
#include "app/daemon/view_side.h"
#include "app/model_store/daemon_signal.h"
#include "app/model_store/usable_model.h"
#include "app/version.h"

namespace plumbline {
namespace {

constexpr int kReportPeriod_ms = 50;

/// SIGTERM, SIGINT and SIGHUP as a file descriptor; blocked in every thread started afterwards.
int OpenSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, number);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

void LogFaults(const FaultList& faults) {
  for (const Fault& fault : faults.All()) {
    Log(fault.severity == Fault::Severity::kFault ? LogLevel::kError : LogLevel::kWarning,
        FaultText(fault));
  }
}

std::unique_ptr<CycleParts> PartsFrom(const ConfigInForce& in_force) {
  const DaemonConfig& config = in_force.config;
  if (const auto why_not = WhyNotUsable(config.machine.cell)) {
    Log(LogLevel::kError, fmt::format("{}: {}", config.cell_file, *why_not));
    return nullptr;
  }
  Result<std::unique_ptr<RobotDevice>> robot = RobotFrom(config);
  if (!robot) {
    Log(LogLevel::kError, fmt::format("robot: {}", robot.error()));
    return nullptr;
  }
  return std::make_unique<CycleParts>(config, std::move(robot).value(), in_force.models.applied);
}

void TellModel(const ModelState& models) {
  if (models.applied == models.declared) return;
  Log(LogLevel::kNotice,
      fmt::format("model version {} in force in place of the cell file", models.applied));
}

Reporter ReporterFor(const DaemonConfig& config) {
  std::vector<Reporter::PointName> names;
  for (const AssemblyPoint& point : config.machine.points) names.push_back({point.id, point.name});
  return {std::move(names), config.machine.cell.domain.has_value(),
          [](LogLevel level, const std::string& text) { Log(level, text); }};
}

/// Says what happened to Modbus clients, at most ten lines a minute: a hostile one causes many.
class ClientEvents {
 public:
  void operator()(const modbus::TcpServerEvent& event) {
    using Kind = modbus::TcpServerEvent::Kind;
    const double now_s = MonotonicSeconds();
    if (now_s - minute_s_ > 60) {
      if (told_ > kMost) {
        Log(LogLevel::kWarning, fmt::format("{} more Modbus client events", told_ - kMost));
      }
      minute_s_ = now_s;
      told_ = 0;
    }
    if (++told_ > kMost) return;
    const char* text = event.kind == Kind::kStranger       ? "refused: not in plc.allow"
                       : event.kind == Kind::kNoRoom       ? "refused: every slot is kept"
                       : event.kind == Kind::kEvicted      ? "closed: longest idle, made room"
                       : event.kind == Kind::kFrameTimeout ? "closed: frame not completed in 1 s"
                       : event.kind == Kind::kNotReading   ? "closed: does not read its answers"
                       : event.kind == Kind::kBrokenFrame  ? "closed: not Modbus"
                                                           : "closed: out of file descriptors";
    Log(LogLevel::kWarning, fmt::format("Modbus client {} {}", event.peer, text));
  }

 private:
  static constexpr int kMost = 10;
  double minute_s_ = -1e9;
  int told_ = 0;
};

modbus::DeviceIdentification Identification() {
  modbus::DeviceIdentification identification;
  identification.objects = {{0, "Plumbline"},
                            {1, "plumblined"},
                            {2, PLUMBLINE_VERSION},
                            {4, "Corrected assembly points"}};
  return identification;
}

/// How the PLC reaches the daemon: opened at the start, changed by a restart only.
struct Opened {
  std::string address;
  int port, unit_id, max_clients;
  std::vector<std::string> allow;
  std::string device;  ///< empty: no serial line
  int baud = 0, stop_bits = 0;
  char parity = 0;
  bool operator==(const Opened&) const = default;
};

Opened OpenedFor(const DaemonConfig& config) {
  const modbus::TcpServerOptions& tcp = config.plc.tcp;
  Opened opened{tcp.address, tcp.port, tcp.unit_id, tcp.max_clients, tcp.allow, "", 0, 0, 0};
  if (const auto& rtu = config.plc.rtu) {
    opened.device = rtu->device;
    opened.baud = rtu->baud;
    opened.stop_bits = rtu->stop_bits;
    opened.parity = rtu->parity;
  }
  return opened;
}

void Reload(const std::string& file, CyclicLoop& loop, LoopWorker& worker, ViewSide& view,
            Reporter& reporter, const DaemonConfig& started) {
  FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(file, faults, started.state_directory);
  LogFaults(faults);
  std::unique_ptr<CycleParts> parts = in_force ? PartsFrom(*in_force) : nullptr;
  if (!parts) {
    Log(LogLevel::kError, "configuration not reloaded; the former one stays in force");
    return;
  }
  const DaemonConfig& fresh = in_force->config;
  if (OpenedFor(fresh) != OpenedFor(started)) {
    Log(LogLevel::kWarning,
        "needs a restart: plc.listen, port, unit_id, max_clients, allow or [plc.rtu] differs from "
        "what the daemon started with");
  }
  if (CameraDiffers(fresh, started)) {
    Log(LogLevel::kWarning,
        "needs a restart: [camera], [zoom], [board], [tags] or the tags' file differs from what "
        "the daemon started with");
  }
  if (in_force->asked_state_directory != started.state_directory) {
    Log(LogLevel::kWarning,
        fmt::format("needs a restart: state_directory, in force is {}", started.state_directory));
  }
  worker.Configure(fresh, in_force->models);  // first: it judges the new machine's first probe too
  loop.Replace(std::move(parts));
  view.Configure(fresh);
  reporter = ReporterFor(fresh);
  Log(LogLevel::kNotice, fmt::format("configuration {} reloaded", file));
  TellModel(in_force->models);
}

/// Tells transitions until a signal ends the daemon.
void Watch(int signals, const std::string& file, CyclicLoop& loop, LoopWorker& worker,
           ViewSide& view, const DaemonConfig& started) {
  Reporter reporter = ReporterFor(started);
  UtcClock clock = loop.clock();
  for (;;) {
    pollfd waiting{signals, POLLIN, 0};
    if (poll(&waiting, 1, kReportPeriod_ms) > 0) {
      signalfd_siginfo info{};
      if (read(signals, &info, sizeof info) != sizeof info) continue;
      if (info.ssi_signo != SIGHUP) {
        Log(LogLevel::kNotice,
            fmt::format("ending on {}", info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT"));
        return;
      }
      Reload(file, loop, worker, view, reporter, started);
    }
    if (const auto step_s = clock.NewStep(ComputerUtcSeconds(), MonotonicSeconds())) {
      Log(LogLevel::kWarning,
          fmt::format(
              "the computer's clock was set by {:+.0f} s: times of probes and of effects go "
              "on as before; a restart takes it up",
              *step_s));
    }
    const std::uint16_t raised = loop.TakeAlarms();
    reporter.Observe(*loop.ReadSnapshot(), raised, loop.parts().link->Status());
    view.TakeTime();
  }
}

std::unique_ptr<ViewPublisher> OpenView(const std::string& state_directory) {
  auto opened = ViewPublisher::Open(ViewSocketOf(state_directory));
  if (opened) return std::move(opened).value();
  Log(LogLevel::kWarning, fmt::format("nothing can be shown on a monitor: {}", opened.error()));
  return nullptr;
}

}  // namespace

int RunDaemon(const std::string& config_file) {
  // Threads' allocation arenas would double the resident memory of a daemon that hardly allocates.
  mallopt(M_ARENA_MAX, 1);
  const int signals = OpenSignals();

  FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(config_file, faults);
  LogFaults(faults);
  if (!in_force) {
    Log(LogLevel::kError,
        fmt::format("not started: mend {} first (plumbline check tells the same)", config_file));
    return 1;
  }
  const DaemonConfig* const config = &in_force->config;
  const Result<DaemonMark> announced = AnnounceDaemon(config->state_directory);
  if (!announced) {
    Log(config->loop.enabled ? LogLevel::kError : LogLevel::kWarning,
        fmt::format("{}state directory: {}; give this daemon a state_directory of its own{}",
                    config->loop.enabled ? "not started: " : "", announced.error(),
                    config->loop.enabled ? "" : ", else `plumbline model` cannot tell it"));
    if (config->loop.enabled) return 2;  // two writers of one journal would alarm for each other
  }

  std::unique_ptr<CycleParts> parts = PartsFrom(*in_force);
  if (!parts) return 1;
  LoopLink link;
  ViewSide view(OpenView(config->state_directory), link);
  const auto camera = CameraWatchFor(*config, link.camera, view);
  if (!camera) {
    Log(LogLevel::kError, camera.error());
    return 1;
  }
  // Whoever asks before the first cycle finds the map's form: numbers of points, none of them
  // valid.
  modbus::RegisterImage first_image;
  first_image.readable = parts->readable;
  first_image.registers = parts->encoder.Encode(parts->machine.Cycle({}), {});
  first_image.bits.resize(plc_map::kBits);
  Latest<modbus::RegisterImage> images(1, first_image);
  modbus::ImageHandler handler(images, EmptyCommandArea(), Identification());

  modbus::TcpServerOptions tcp = config->plc.tcp;
  tcp.on_event = ClientEvents();
  const auto server = modbus::TcpServer::Start(tcp, handler);
  if (!server) {
    Log(LogLevel::kError, fmt::format("PLC side: {}", server.error()));
    return 2;
  }
  std::unique_ptr<modbus::RtuSlave> slave;
  if (config->plc.rtu) {
    modbus::RtuSlaveOptions rtu = *config->plc.rtu;
    rtu.on_change = [device = rtu.device](const std::string& lost_because) {
      if (lost_because.empty()) {
        Log(LogLevel::kNotice, fmt::format("serial line {} open", device));
      } else {
        Log(LogLevel::kError, fmt::format("serial line {}: {}", device, lost_because));
      }
    };
    auto started = modbus::RtuSlave::Start(rtu, handler);
    if (!started) {
      Log(LogLevel::kError, fmt::format("PLC side: {}", started.error()));
      return 2;
    }
    slave = std::move(started).value();
  }

  std::uint16_t boot_count = 0;  // of starts that came this far
  if (const Result<std::uint16_t> raised = RaiseBootCounter(config->state_directory); raised) {
    boot_count = *raised;
  } else {
    Log(LogLevel::kWarning, fmt::format("boot counter not kept: {}", raised.error()));
  }
  LoopWorker worker(
      link, [](LogLevel level, const std::string& text) { Log(level, text); },
      [] { kill(getpid(), SIGHUP); });
  worker.Configure(*config, in_force->models);
  worker.Start();
  CyclicLoop loop(std::move(parts), handler, images, link, boot_count, server->get());
  loop.Start();
  view.Configure(*config);
  view.Start(loop);
  if (*camera) (*camera)->Start();
  Log(LogLevel::kNotice,
      fmt::format("plumblined {} with {} ({} points), PLC side on {}:{}", PLUMBLINE_VERSION,
                  config->machine.cell.robot.name, config->machine.points.size(),
                  config->plc.tcp.address, (*server)->port()));
  TellModel(in_force->models);
  malloc_trim(0);
  Watch(signals, config_file, loop, worker, view, *config);
  if (*camera) (*camera)->Stop();
  loop.Stop();
  worker.Stop();
  if (const RobotLinkStatus robot = loop.parts().link->Status();
      robot.push_result != LinkResult::kOk) {
    Log(LogLevel::kWarning, fmt::format("pushed points may still stand in the controller: {}",
                                        LinkResultText(robot.push_result)));
  }
  return 0;
}

}  // namespace plumbline
