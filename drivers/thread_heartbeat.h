// Heartbeat counter of a thread, polled by the watchdog.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cstdint>

namespace plumbline {

/// Incremented by a thread on every iteration, polled by the watchdog. A thread that waits for
/// events must wake up and beat at least every kMaxBeatInterval_s.
class ThreadHeartbeat {
 public:
  static constexpr double kMaxBeatInterval_s = 0.5;

  void Beat() {
    if (thread_.load(std::memory_order_relaxed) == 0) thread_ = gettid();
    beats_.fetch_add(1, std::memory_order_relaxed);
  }
  std::uint64_t beats() const { return beats_.load(std::memory_order_relaxed); }
  /// Kernel id of the thread that beats; 0 if none has yet.
  pid_t thread() const { return thread_; }

 private:
  std::atomic<std::uint64_t> beats_{0};
  std::atomic<pid_t> thread_{0};
};

}  // namespace plumbline
