#include "firmware-like/monitor/radius_contradiction.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace plumbline::monitor {
namespace {

constexpr double kChance = 1e-4;  // as of the other tests of a reference

}  // namespace

bool ContradictsRadius(double mean_m, double radius_m, double sigma_of_mean_m) {
  assert(sigma_of_mean_m > 0);
  if (!(radius_m > 0) || !(mean_m > radius_m)) return false;
  const double a = (mean_m - radius_m) / (sigma_of_mean_m * std::numbers::sqrt2);
  const double b = (mean_m + radius_m) / (sigma_of_mean_m * std::numbers::sqrt2);
  const double chance = (std::erfc(a) + std::erfc(b)) / 2 +
                        sigma_of_mean_m / (radius_m * std::sqrt(2 * std::numbers::pi)) *
                            (std::exp(-a * a) - std::exp(-b * b));
  return chance < kChance;
}

}  // namespace plumbline::monitor
