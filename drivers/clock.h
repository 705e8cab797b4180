// Monotonic clock and sleep functions, injectable for tests.
#pragma once

#include <ctime>

namespace plumbline {

/// Returns monotonic time [s]; injected, so that tests control the time.
using Clock = double (*)();

/// CLOCK_MONOTONIC [s].
inline double MonotonicSeconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Sleeps for a duration [s]; injected together with the clock.
using Sleep = void (*)(double);

/// Sleeps for `seconds`; returns early if a signal arrives, so that Ctrl-C takes effect at once.
inline void SleepSeconds(double seconds) {
  if (!(seconds > 0)) return;
  timespec left{};
  left.tv_sec = static_cast<time_t>(seconds);
  left.tv_nsec = static_cast<long>(1e9 * (seconds - static_cast<double>(left.tv_sec)));
  clock_nanosleep(CLOCK_MONOTONIC, 0, &left, nullptr);
}

}  // namespace plumbline
