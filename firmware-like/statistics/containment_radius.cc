#include "firmware-like/statistics/containment_radius.h"

#include <cmath>

#include "firmware-like/statistics/chi_square.h"

namespace plumbline::statistics {

double RadiusHolding95Percent(const Mat3& covariance) {
  const double trace = covariance.trace();
  if (trace <= 0) return 0;
  const double trace_of_square = covariance.squaredNorm();
  const double freedom = trace * trace / trace_of_square;
  return std::sqrt(trace / freedom * ChiSquareQuantileNear(kNormal95, freedom));
}

}  // namespace plumbline::statistics
