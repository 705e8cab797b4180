// Residual against a signal: points in the order of the signal, and their means over bins.
#pragma once

#include <vector>

namespace plumbline::measure {

/// A signal's values with one component of the residual [mm], sorted by value.
struct Cloud {
  std::vector<double> value, before, after;
};

struct Bin {
  double value = 0, before = 0, after = 0;
  int count = 0;
  bool after_gap = false;  ///< the values have a gap before this bin
};

/// Means over bins of equal count along the signal. Equal values share a bin, and no bin spans a
/// gap in the values.
std::vector<Bin> BinsOf(const Cloud& cloud);

}  // namespace plumbline::measure
