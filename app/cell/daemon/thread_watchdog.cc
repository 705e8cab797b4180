#include "app/cell/daemon/thread_watchdog.h"

#include <utility>

namespace plumbline::cell {

namespace {

/// Fraction of the timeout after which the watchdog checks whether a thread waits for a device.
constexpr double kLateFraction = 0.5;

}  // namespace

void ThreadWatchdog::Add(std::string thread, double timeout_s, std::function<std::uint64_t()> beats,
                         std::function<bool()> in_device) {
  threads_.push_back({std::move(thread), timeout_s, std::move(beats), std::move(in_device)});
}

void ThreadWatchdog::SetTimeout(const std::string& name, double timeout_s) {
  for (Thread& thread : threads_) {
    if (thread.name == name) thread.timeout_s = timeout_s;
  }
}

ThreadWatchdog::StalledThread ThreadWatchdog::Check(double now_s) {
  StalledThread first;
  for (Thread& thread : threads_) {
    const std::uint64_t beats = thread.beats();
    if (!thread.checked || beats != thread.last_beats) {
      thread.checked = true;
      thread.last_beats = beats;
      thread.last_beat_s = thread.excused_until_s = now_s;
    }
    const double silent_s = now_s - thread.last_beat_s;
    if (silent_s > kLateFraction * thread.timeout_s && silent_s <= kDeviceTimeout_s &&
        thread.in_device()) {
      thread.excused_until_s = now_s;
    }
    if (first.name.empty() && now_s - thread.excused_until_s > thread.timeout_s) {
      first = {thread.name, silent_s};
    }
  }
  return first;
}

}  // namespace plumbline::cell
