// How many digits a printed number needs beside its deviation.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace plumbline {

/// Decimals that show each of these deviations with two significant digits at least, so that none
/// reads as 0.00: 0.0042 needs 4. A deviation of 0 was not estimated, and needs none.
/// @param least  decimals that are printed in any case
inline int DecimalsFor(std::initializer_list<double> deviations, int least) {
  constexpr int kMost = 9;
  int decimals = least;
  for (const double deviation : deviations) {
    if (!(deviation > 0) || !std::isfinite(deviation)) continue;
    decimals = std::max(decimals, 1 - static_cast<int>(std::floor(std::log10(deviation))));
  }
  return std::min(decimals, kMost);
}

}  // namespace plumbline
