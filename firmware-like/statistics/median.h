// Median of a range of numbers.
#pragma once

#include <algorithm>
#include <cassert>
#include <span>

namespace plumbline::statistics {

/// Median of the values; for an even count the mean of the two middle ones. Does not allocate.
/// @param values  at least one, no NaN; reordered by the call
inline double MedianOf(std::span<double> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace plumbline::statistics
