#include "app/cell/daemon/watchdog_feeder.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/log/log.h"

namespace plumbline::cell {
namespace {

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

}  // namespace

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

}  // namespace plumbline::cell
