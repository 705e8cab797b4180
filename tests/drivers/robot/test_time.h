// A clock controlled by the test, and a real-time limit for the link.
#pragma once

#include <atomic>

namespace plumbline::robot {

/// Generous limit: also holds while other tests and a build are running.
inline constexpr double kLinkTimeout_s = 0.3;

inline std::atomic<double> g_test_time_s{1000};

inline double TestTime() {
  return g_test_time_s;
}

inline void Advance(double seconds) {
  g_test_time_s = g_test_time_s + seconds;
}

}  // namespace plumbline::robot
