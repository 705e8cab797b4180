#include "app/measure/accuracy/conformity.h"

#include <cmath>

namespace plumbline::measure {

Decision Decide(double error_m, double expanded_m, double tolerance_m) {
  const double size_m = std::abs(error_m);
  if (size_m + expanded_m <= tolerance_m) return Decision::kConforms;
  if (size_m - expanded_m > tolerance_m) return Decision::kDoesNotConform;
  return Decision::kNotDecided;
}

}  // namespace plumbline::measure
