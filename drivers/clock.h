// The time that devices count by.
#pragma once

#include <ctime>

namespace plumbline {

/// Monotonic time in seconds; injected so that tests own the time.
using Clock = double (*)();

/// CLOCK_MONOTONIC [s].
inline double MonotonicSeconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Waits so long [s]; injected with the clock.
using Sleep = void (*)(double);

/// A signal ends it early: whoever waits for Ctrl-C shall see it.
inline void SleepSeconds(double seconds) {
  if (!(seconds > 0)) return;
  timespec left{};
  left.tv_sec = static_cast<time_t>(seconds);
  left.tv_nsec = static_cast<long>(1e9 * (seconds - static_cast<double>(left.tv_sec)));
  clock_nanosleep(CLOCK_MONOTONIC, 0, &left, nullptr);
}

}  // namespace plumbline
