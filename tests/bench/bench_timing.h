// Timing of a benchmark: CPU time and median.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <vector>

namespace plumbline::bench {

/// CPU time of this thread, independent of other load on the machine.
inline double CpuTime_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// The upper of the two middle values if their number is even; 0 without values.
inline double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace plumbline::bench
