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

}  // namespace plumbline
