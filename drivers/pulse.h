// A thread's sign of life.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cstdint>

namespace plumbline {

/// Raised by a thread each time it comes round, looked at by whoever would miss it. A thread that
/// waits for something to happen comes round every kLongestRest_s at least.
class Pulse {
 public:
  static constexpr double kLongestRest_s = 0.5;

  void Beat() {
    if (thread_.load(std::memory_order_relaxed) == 0) thread_ = gettid();
    beats_.fetch_add(1, std::memory_order_relaxed);
  }
  std::uint64_t beats() const { return beats_.load(std::memory_order_relaxed); }
  /// The kernel's number of the thread that raises it; 0: none has yet.
  pid_t thread() const { return thread_; }

 private:
  std::atomic<std::uint64_t> beats_{0};
  std::atomic<pid_t> thread_{0};
};

}  // namespace plumbline
