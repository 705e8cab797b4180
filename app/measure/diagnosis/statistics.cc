#include "app/measure/diagnosis/statistics.h"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace plumbline::measure {

double FisherTail(double value, double d1, double d2) {
  if (value <= 0) return 1;
  return Eigen::numext::betainc(d2 / 2, d1 / 2, d2 / (d2 + d1 * value));
}

std::uint64_t Random::Next() {
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

double Random::Uniform() {
  return static_cast<double>(Next() >> 11) * 0x1.0p-53;
}

int Random::Below(int count) {
  return static_cast<int>(Uniform() * count);
}

}  // namespace plumbline::measure
