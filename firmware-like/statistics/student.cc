#include "firmware-like/statistics/student.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <unsupported/Eigen/SpecialFunctions>

namespace plumbline::statistics {
namespace {

constexpr double kNearlyNormal = 1e9;  // degrees of freedom; the factors differ by less than 1e-8

/// P(|t| > value).
double StudentTwoSidedTail(double value, double freedom) {
  if (freedom > kNearlyNormal) return std::erfc(value / std::numbers::sqrt2);
  return Eigen::numext::betainc(freedom / 2, 0.5, freedom / (freedom + value * value));
}

}  // namespace

double StudentCoverageFactor(double coverage, double freedom) {
  const double tail = 1 - coverage;
  double low = 0, high = 1;
  while (StudentTwoSidedTail(high, freedom) > tail) high *= 2;
  for (;;) {
    const double middle = (low + high) / 2;
    if (middle <= low || middle >= high) return middle;
    (StudentTwoSidedTail(middle, freedom) > tail ? low : high) = middle;
  }
}

}  // namespace plumbline::statistics
