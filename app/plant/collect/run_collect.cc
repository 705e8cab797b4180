#include "app/plant/collect/run_collect.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>

#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/plant/collect/collect_loop.h"
#include "app/version.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

constexpr double kStatusPeriod_s = 1;

std::optional<PlantConfig> ReadCollectConfig(const std::string& file) {
  config::FaultList faults;
  PlantConfig config = ReadPlantConfig(file, faults);
  for (const config::Fault& fault : faults.All()) log::LogFault(fault);
  if (!faults.HasFaults()) return config;
  log::Log(
      {log::Event::kCollectNotStarted,
       fmt::format("{} is not used: it has the faults logged above; fix them, and start or reload "
                   "again",
                   file)});
  return std::nullopt;
}

}  // namespace

int RunCollect(const std::string& config_file) {
  mallopt(M_ARENA_MAX, 2);
  const service::ServiceManager manager;
  const int signals = service::OpenSignalDescriptor();
  auto config = ReadCollectConfig(config_file);
  if (!config) return 1;
  log::Log({log::Event::kCollectStarted, fmt::format("plumbline-collect {}, collector {}",
                                                     PLUMBLINE_VERSION, config->collect.name)});
  auto loop = std::make_unique<CollectLoop>(*config);
  manager.Ready(loop->Status());
  double fed_s = -1e300, status_s = -1e300;
  std::string shown;
  for (;;) {
    signalfd_siginfo info{};
    if (read(signals, &info, sizeof info) == sizeof info) {
      if (info.ssi_signo != SIGHUP) break;
      manager.Reloading();
      if (auto fresh = ReadCollectConfig(config_file)) {
        config = std::move(fresh);
        loop = std::make_unique<CollectLoop>(*config);
        log::Log({log::Event::kReloaded, fmt::format("configuration {} reloaded", config_file)});
      }
      manager.Ready(loop->Status());
    }
    loop->RunOnce();
    const double now_s = MonotonicSeconds();
    if (manager.watchdog_period_s() && now_s - fed_s >= *manager.watchdog_period_s()) {
      fed_s = now_s;
      manager.NotifyWatchdog();
    }
    if (now_s - status_s < kStatusPeriod_s) continue;
    status_s = now_s;
    log::FlushLog();
    if (std::string status = loop->Status(); status != shown) {
      manager.Status(status);
      shown = std::move(status);
    }
  }
  manager.Stopping();
  log::FlushLog(true);
  return 0;
}

}  // namespace plumbline::plant
