#include "firmware-like/statistics/statistics.h"

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

double RadiusHolding95Percent(const Mat3& covariance) {
  const double trace = covariance.trace();
  if (trace <= 0) return 0;
  const double trace_of_square = covariance.squaredNorm();
  const double freedom = trace * trace / trace_of_square;
  return std::sqrt(trace / freedom * ChiSquareQuantileNear(kNormal95, freedom));
}

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

double ChiSquareQuantileNear(double normal, double freedom) {
  const double h = 2 / (9 * freedom);
  const double root = 1 - h + normal * std::sqrt(h);
  return freedom * root * root * root;
}

}  // namespace plumbline::statistics
