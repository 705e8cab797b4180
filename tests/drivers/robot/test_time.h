// A clock that the test moves, and the patience of a link in real time.
#pragma once

#include <atomic>

namespace plumbline {

/// An answer takes less, also beside other tests and a build.
inline constexpr double kLinkTimeout_s = 0.3;

inline std::atomic<double> g_test_time_s{1000};

inline double TestTime() {
  return g_test_time_s;
}

inline void Advance(double seconds) {
  g_test_time_s = g_test_time_s + seconds;
}

}  // namespace plumbline
