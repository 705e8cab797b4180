#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::containment_radius_test {

TEST_CASE("the 95 % radius contains 95 % of normal errors with any covariance") {
  std::mt19937 random(13);
  std::normal_distribution<double> normal;
  for (const Vec3& sigma : {Vec3(1, 1, 1), Vec3(1, 0.5, 0.1), Vec3(1, 0, 0), Vec3(1, 1, 0)}) {
    const Mat3 covariance = sigma.cwiseAbs2().asDiagonal();
    const double radius = statistics::RadiusHolding95Percent(covariance);
    int inside = 0;
    constexpr int kDraws = 200000;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Vec3 error(sigma.x() * normal(random), sigma.y() * normal(random),
                       sigma.z() * normal(random));
      inside += error.norm() <= radius ? 1 : 0;
    }
    CAPTURE(sigma.transpose());
    CHECK(inside / double{kDraws} == Approx(0.95).margin(0.006));
  }
}

}  // namespace plumbline::containment_radius_test
