// Numbers as they are printed.
#pragma once

#include <cmath>

namespace plumbline {

/// 0 in place of what prints as -0.00 with so many decimals.
inline double WithoutMinusZero(double value, int decimals) {
  return std::abs(value) < 0.5 * std::pow(10.0, -decimals) ? 0.0 : value;
}

}  // namespace plumbline
