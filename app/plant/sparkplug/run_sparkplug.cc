#include "app/plant/sparkplug/run_sparkplug.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <optional>

#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/plant/broker/memory_limit.h"
#include "app/plant/sparkplug/bridge.h"
#include "app/version.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

constexpr double kReportPeriod_s = 1;
/// A connection with TLS, and a node's share of Bridge::kMaxMetrics; several times over.
constexpr std::size_t kGrowthOfNode_bytes = 100'000;
constexpr int kSpareDescriptors = 64;

std::optional<SparkplugConfig> ReadBridgeConfig(const std::string& file) {
  config::FaultList faults;
  auto config = ReadSparkplugConfig(file, faults);
  log::LogFaults(faults);
  if (!config) {
    log::Log({log::Event::kSparkplugNotStarted,
              fmt::format("{} has the faults logged above; fix the reported lines", file)});
  }
  return config;
}

/// In the folder that the service manager provides (StateDirectory=); empty without one.
std::string PointsFile() {
  const char* const folder = std::getenv("STATE_DIRECTORY");
  return folder == nullptr ? "" : std::string(folder) + "/points.json";
}

/// Feeds the service manager's watchdog and shows the bridge's status.
class BridgeReport {
 public:
  explicit BridgeReport(const service::ServiceManager& manager) : manager_(manager) {}
  void Update(const Bridge& bridge) {
    const double now_s = MonotonicSeconds();
    if (manager_.watchdog_period_s() && now_s - fed_s_ >= *manager_.watchdog_period_s()) {
      fed_s_ = now_s;
      manager_.NotifyWatchdog();
    }
    if (now_s - reported_s_ < kReportPeriod_s) return;
    reported_s_ = now_s;
    log::FlushLog();
    std::string status = bridge.Status();
    if (status != status_) manager_.Status(status);
    status_ = std::move(status);
  }

 private:
  const service::ServiceManager& manager_;
  double fed_s_ = -1e300, reported_s_ = -1e300;
  std::string status_;
};

/// @return  the signal received
int RunBridge(Bridge& bridge, const service::ServiceManager& manager, int signals) {
  BridgeReport report(manager);
  for (;;) {
    signalfd_siginfo info{};
    if (read(signals, &info, sizeof info) == sizeof info) return static_cast<int>(info.ssi_signo);
    bridge.RunOnce(signals);
    report.Update(bridge);
  }
}

}  // namespace

int RunSparkplug(const std::string& config_file) {
  mallopt(M_ARENA_MAX, 1);
  const service::ServiceManager manager;
  const int signals = service::OpenSignalDescriptor();
  auto config = ReadBridgeConfig(config_file);
  if (!config) return 1;
  for (;;) {
    const int wanted = config->max_nodes + kSpareDescriptors;
    if (const int allowed = service::RaiseDescriptorLimit(wanted); allowed < wanted)
      config->max_nodes = allowed - kSpareDescriptors;
    const MemoryGrowthLimit limit(
        kMaxGrowth_bytes + kGrowthOfNode_bytes * static_cast<std::size_t>(config->max_nodes));
    Bridge bridge(*config, PointsFile());
    log::Log(
        {log::Event::kSparkplugStarted, fmt::format("plumbline-sparkplug {}, up to {} edge nodes",
                                                    PLUMBLINE_VERSION, config->max_nodes)});
    manager.Ready(bridge.Status());
    std::optional<SparkplugConfig> fresh;
    while (!fresh) {
      if (RunBridge(bridge, manager, signals) != SIGHUP) {
        manager.Stopping();
        bridge.End();
        log::FlushLog(true);
        return 0;
      }
      manager.Reloading();
      fresh = ReadBridgeConfig(config_file);
      if (!fresh) manager.Ready(bridge.Status());
    }
    bridge.End();
    config = std::move(fresh);
  }
}

}  // namespace plumbline::plant
