#include "firmware-like/statistics/chi_square.h"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace plumbline::statistics {

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
