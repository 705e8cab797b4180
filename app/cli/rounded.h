// Rounding of printed numbers.
#pragma once

#include <cmath>

namespace plumbline::cli {

/// The value, or 0 if it would be printed as -0.00 with that many decimals.
inline double WithoutNegativeZero(double value, int decimals) {
  return std::abs(value) < 0.5 * std::pow(10.0, -decimals) ? 0.0 : value;
}

}  // namespace plumbline::cli
