#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <mutex>

#include "app/config/daemon_config_reader.h"
#include "app/daemon/boot_counter.h"
#include "app/daemon/cyclic_loop.h"
#include "app/daemon/reporter.h"
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

std::unique_ptr<CycleParts> PartsFrom(const DaemonConfig& config) {
  if (!config.cell.effects.empty()) {  // to leave one out would correct wrongly
    Log(LogLevel::kError, fmt::format("{}: effect \"{}\" cannot be applied by this version",
                                      config.cell_file, config.cell.effects.front().id));
    return nullptr;
  }
  Result<std::unique_ptr<RobotDevice>> robot = RobotFrom(config);
  if (!robot) {
    Log(LogLevel::kError, fmt::format("robot: {}", robot.error()));
    return nullptr;
  }
  return std::make_unique<CycleParts>(config, std::move(robot).value());
}

Reporter ReporterFor(const DaemonConfig& config) {
  std::vector<Reporter::PointName> names;
  for (const AssemblyPoint& point : config.points) names.push_back({point.id, point.name});
  return {std::move(names), [](LogLevel level, const std::string& text) { Log(level, text); }};
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

void Reload(const std::string& file, CyclicLoop& loop, Reporter& reporter, DaemonConfig& config) {
  FaultList faults;
  std::optional<DaemonConfig> fresh = ReadDaemonConfig(file, faults);
  LogFaults(faults);
  std::unique_ptr<CycleParts> parts = fresh ? PartsFrom(*fresh) : nullptr;
  if (!parts) {
    Log(LogLevel::kError, "configuration not reloaded; the former one stays in force");
    return;
  }
  if (fresh->plc.listen != config.plc.listen || fresh->plc.port != config.plc.port ||
      fresh->plc.unit_id != config.plc.unit_id || fresh->plc.allow != config.plc.allow ||
      fresh->plc.max_clients != config.plc.max_clients) {
    Log(LogLevel::kWarning, "plc.listen, port, unit_id, allow and max_clients change by a restart");
  }
  loop.Replace(std::move(parts));
  config = std::move(*fresh);
  reporter = ReporterFor(config);
  Log(LogLevel::kNotice, fmt::format("configuration {} reloaded", file));
}

/// Tells transitions until a signal ends the daemon.
void Watch(int signals, const std::string& file, CyclicLoop& loop, DaemonConfig& config) {
  Reporter reporter = ReporterFor(config);
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
      Reload(file, loop, reporter, config);
    }
    const std::uint16_t raised = loop.TakeAlarms();
    const auto snapshot = loop.ReadSnapshot();
    reporter.Observe(*snapshot, raised, loop.parts().link->Status());
  }
}

}  // namespace

int RunDaemon(const std::string& config_file) {
  // Threads' allocation arenas would double the resident memory of a daemon that hardly allocates.
  mallopt(M_ARENA_MAX, 1);
  const int signals = OpenSignals();

  FaultList faults;
  std::optional<DaemonConfig> config = ReadDaemonConfig(config_file, faults);
  LogFaults(faults);
  if (!config) {
    Log(LogLevel::kError,
        fmt::format("not started: mend {} first (plumbline check tells the same)", config_file));
    return 1;
  }
  std::uint16_t boot_count = 0;
  if (const Result<std::uint16_t> raised = RaiseBootCounter(config->state_directory); raised) {
    boot_count = *raised;
  } else {
    Log(LogLevel::kWarning, fmt::format("boot counter not kept: {}", raised.error()));
  }

  std::unique_ptr<CycleParts> parts = PartsFrom(*config);
  if (!parts) return 1;
  modbus::RegisterImage first_image;
  first_image.readable = parts->readable;
  first_image.registers.resize(parts->encoder.size());
  first_image.bits.resize(plc_map::kBits);
  Latest<modbus::RegisterImage> images(1, first_image);
  modbus::ImageHandler handler(images, EmptyCommandArea(), Identification());

  modbus::TcpServerOptions tcp = TcpServerOptionsFrom(config->plc);
  tcp.on_event = ClientEvents();
  const auto server = modbus::TcpServer::Start(tcp, handler);
  if (!server) {
    Log(LogLevel::kError, fmt::format("PLC side: {}", server.error()));
    return 1;
  }
  std::unique_ptr<modbus::RtuSlave> slave;
  if (config->plc.rtu) {
    modbus::RtuSlaveOptions rtu = RtuSlaveOptionsFrom(config->plc);
    rtu.on_change = [device = rtu.device](const std::string& lost_because) {
      if (lost_because.empty()) {
        Log(LogLevel::kNotice, fmt::format("serial line {} open", device));
      } else {
        Log(LogLevel::kError, fmt::format("serial line {} lost: {}", device, lost_because));
      }
    };
    auto started = modbus::RtuSlave::Start(rtu, handler);
    if (!started) {
      Log(LogLevel::kError, fmt::format("PLC side: {}", started.error()));
      return 1;
    }
    slave = std::move(started).value();
  }

  CyclicLoop loop(std::move(parts), handler, images, boot_count, server->get());
  loop.Start();
  Log(LogLevel::kNotice, fmt::format("plumblined {} with {} ({} points), PLC side on {}:{}",
                                     PLUMBLINE_VERSION, config->cell.robot.name,
                                     config->points.size(), config->plc.listen, (*server)->port()));
  malloc_trim(0);
  Watch(signals, config_file, loop, *config);
  loop.Stop();
  return 0;
}

}  // namespace plumbline
