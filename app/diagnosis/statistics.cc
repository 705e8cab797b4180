#include "app/diagnosis/statistics.h"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace plumbline {

double ChiSquareTail(double value, double freedom) {
  return value <= 0 ? 1.0 : Eigen::numext::igammac(freedom / 2, value / 2);
}

double ChiSquareQuantile(double tail, double freedom) {
  double low = 0, high = freedom + 20;
  while (ChiSquareTail(high, freedom) > tail) high *= 2;
  for (int step = 0; step < 100; ++step) {
    const double middle = (low + high) / 2;
    (ChiSquareTail(middle, freedom) > tail ? low : high) = middle;
  }
  return (low + high) / 2;
}

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

}  // namespace plumbline
