// A clock that the test moves.
#pragma once

#include <atomic>

namespace plumbline {

inline std::atomic<double> g_test_time_s{1000};

inline double TestTime() {
  return g_test_time_s;
}

inline void Advance(double seconds) {
  g_test_time_s = g_test_time_s + seconds;
}

}  // namespace plumbline
