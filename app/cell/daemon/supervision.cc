#include "app/cell/daemon/supervision.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <optional>

#include "app/base/log/log.h"
#include "app/cell/daemon/reload.h"
#include "app/cell/daemon/watchdog_feeder.h"

namespace plumbline::cell {
namespace {

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

}  // namespace

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
      feeder.Update(*snapshot, running.cycle.counters(), now_s);
    }
    UpdateAffinity(running, now_s);
    running.plc.DepositConnections(running.manager);
    running.display.PublishIfDue();
    log::FlushLog();
  }
}

}  // namespace plumbline::cell
