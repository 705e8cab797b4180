// Number of decimals for printing a value with its standard deviation.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace plumbline::text {

/// Number of decimals that shows each of these deviations with at least two significant digits, so
/// that none is printed as 0.00: 0.0042 needs 4. A deviation of 0 was not estimated and is ignored.
/// @param least  minimum number of decimals
inline int DecimalsFor(std::initializer_list<double> deviations, int least) {
  constexpr int kMost = 9;
  int decimals = least;
  for (const double deviation : deviations) {
    if (!(deviation > 0) || !std::isfinite(deviation)) continue;
    decimals = std::max(decimals, 1 - static_cast<int>(std::floor(std::log10(deviation))));
  }
  return std::min(decimals, kMost);
}

}  // namespace plumbline::text
