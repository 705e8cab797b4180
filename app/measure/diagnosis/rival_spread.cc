#include "app/measure/diagnosis/rival_spread.h"

#include <algorithm>
#include <cmath>

namespace plumbline::measure {

double VarianceBetweenRivals(const Diagnosis& diagnosis) {
  double most_m2 = 0;
  for (const Rival& rival : diagnosis.rivals) {
    double sum_m2 = 0;
    for (const Vec3& shift_W : rival.shift_W) sum_m2 += shift_W.squaredNorm() / 3;
    const double rows = static_cast<double>(std::max<std::size_t>(1, rival.shift_W.size()));
    most_m2 = std::max(most_m2, sum_m2 / rows);
  }
  return most_m2;
}

RivalSpread SpreadOfRivals(const std::vector<RivalSeparation>& separations,
                           const kinematics::PoseDistance& from, double axes) {
  double n = 0, sum_x = 0, sum_xx = 0, sum_y = 0, sum_xy = 0;
  for (const RivalSeparation& at : separations) {
    const double x = std::pow(from.Of(at.q), 2), y = at.distance_m * at.distance_m / axes;
    n += 1, sum_x += x, sum_xx += x * x, sum_y += y, sum_xy += x * y;
  }
  if (n == 0) return {};
  const double spread = n * sum_xx - sum_x * sum_x;
  const double slope = spread > 0 ? (n * sum_xy - sum_x * sum_y) / spread : 0;
  const double intercept = (sum_y - slope * sum_x) / n;
  if (slope < 0) return {std::sqrt(sum_y / n), 0};
  if (intercept < 0) return {0, sum_xx > 0 ? std::sqrt(sum_xy / sum_xx) : 0};
  return {std::sqrt(intercept), std::sqrt(slope)};
}

}  // namespace plumbline::measure
