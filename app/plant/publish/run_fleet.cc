#include "app/plant/publish/run_fleet.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <optional>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/plant/broker/memory_limit.h"
#include "app/plant/publish/fleet_loop.h"
#include "app/version.h"
#include "drivers/clock.h"
#include "drivers/files/open_failure.h"

namespace plumbline::plant {
namespace {

constexpr double kDisconnectTimeout_s = 2;
constexpr double kStatusPeriod_s = 1;
/// Longer than the timeouts of a name lookup, during which the link's thread has no heartbeat.
constexpr double kLinkTimeout_s = 120;

std::optional<config::DaemonConfig> ReadFleetConfig(const std::string& file) {
  config::FaultList faults;
  auto config = config::ReadDaemonConfig(file, faults);
  for (const config::Fault& fault : faults.All()) {
    // The daemon logs the other warnings.
    const bool ours = fault.key.rfind("mqtt", 0) == 0;
    if (ours || fault.severity == config::Fault::Severity::kFault) log::LogFault(fault);
  }
  if (config && config->mqtt) return config;
  log::Log({log::Event::kFleetNotStarted,
            config
                ? fmt::format("not started: {} has no [mqtt] section, which names the broker", file)
                : fmt::format("not started: {} has the faults logged above; fix them and run "
                              "'plumbline check' to verify",
                              file)});
  return std::nullopt;
}

Result<FleetQueue> OpenQueue(const config::DaemonConfig& config) {
  const std::string folder = FleetFolderOf(config.state_directory);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return Error{fmt::format("{}: {}", folder, files::WriteErrorText(folder, failed.message()))};
  return FleetQueue::Open(folder + "/queue.sqlite", config.mqtt->queue_bytes);
}

/// Feeds the service manager's watchdog while the loop and the link's thread respond.
class Watchdog {
 public:
  explicit Watchdog(const service::ServiceManager& manager) : manager_(manager) {}
  void Update(const FleetLoop& loop) {
    const double now_s = MonotonicSeconds();
    if (loop.link_beats() != beats_) {
      beats_ = loop.link_beats();
      beat_s_ = now_s;
    }
    const bool alive = now_s - beat_s_ < kLinkTimeout_s;
    if (manager_.watchdog_period_s() && now_s - fed_s_ >= *manager_.watchdog_period_s() && alive) {
      fed_s_ = now_s;
      manager_.NotifyWatchdog();
    }
    if (now_s - status_s_ < kStatusPeriod_s) return;
    status_s_ = now_s;
    log::FlushLog();
    std::string status = loop.Status();
    if (status != status_) manager_.Status(status);
    status_ = std::move(status);
  }

 private:
  const service::ServiceManager& manager_;
  std::uint64_t beats_ = 0;
  double beat_s_ = MonotonicSeconds(), fed_s_ = -1e300, status_s_ = -1e300;
  std::string status_;
};

/// @return  the signal received
int RunUntilSignal(FleetLoop& loop, const service::ServiceManager& manager, int signals) {
  Watchdog watchdog(manager);
  for (;;) {
    signalfd_siginfo info{};
    if (read(signals, &info, sizeof info) == sizeof info) return static_cast<int>(info.ssi_signo);
    loop.RunOnce();
    watchdog.Update(loop);
  }
}

}  // namespace

int RunFleet(const std::string& config_file) {
  mallopt(M_ARENA_MAX, 2);
  const service::ServiceManager manager;
  const int signals = service::OpenSignalDescriptor();
  const MemoryGrowthLimit limit(kMaxGrowth_bytes);
  auto config = ReadFleetConfig(config_file);
  if (!config) return 1;
  for (;;) {
    auto queue = OpenQueue(*config);
    if (!queue) {
      log::Log({log::Event::kFleetNotStarted, "not started: queue: " + queue.error()});
      return 2;
    }
    log::Log({log::Event::kFleetStarted, fmt::format("plumbline-fleet {}, {} messages queued",
                                                     PLUMBLINE_VERSION, queue.value().size())});
    FleetLoop loop(*config, std::move(queue).value());
    manager.Ready(loop.Status());
    std::optional<config::DaemonConfig> fresh;
    while (!fresh) {
      if (RunUntilSignal(loop, manager, signals) != SIGHUP) {
        manager.Stopping();
        loop.End(kDisconnectTimeout_s);
        log::FlushLog(true);
        return 0;
      }
      manager.Reloading();
      fresh = ReadFleetConfig(config_file);
      if (!fresh) {
        log::Log(
            {log::Event::kNotReloaded,
             "configuration not reloaded; the previous one stays in force. Fix the faults logged "
             "above"});
        manager.Ready(loop.Status());
      }
    }
    loop.End(kDisconnectTimeout_s);
    config = std::move(fresh);
    log::Log({log::Event::kReloaded, fmt::format("configuration {} reloaded", config_file)});
  }
}

}  // namespace plumbline::plant
