#include "firmware-like/monitor/radius_contradiction.h"

#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/monitor/drift_monitor.h"

namespace plumbline::radius_contradiction_test {

using namespace plumbline::monitor;

TEST_CASE("a mean within the radius, or without one, contradicts nothing; a far one does") {
  CHECK_FALSE(ContradictsRadius(1.9e-3, 2e-3, 1e-5));
  CHECK_FALSE(ContradictsRadius(42e-3, 0, 1e-5));
  CHECK(ContradictsRadius(42e-3, 2e-3, 1e-5));
  CHECK_FALSE(ContradictsRadius(2.02e-3, 2e-3, 1e-5));  // two standard deviations
  CHECK(ContradictsRadius(2.06e-3, 2e-3, 1e-5));        // six
  CHECK_FALSE(ContradictsRadius(2.06e-3, 2e-3, 1e-4));
}

TEST_CASE("an error as large as the radius is called a contradiction no more often than stated") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  constexpr int kTrials = 400'000;
  for (const double sigma : {0.05, 0.5, 2.0}) {  // relative to the radius
    int found = 0;
    for (int k = 0; k < kTrials; ++k) {
      const Vec3 noise(normal(random), normal(random), normal(random));
      found += ContradictsRadius((Vec3(0.6, 0, 0.8) + sigma * noise).norm(), 1, sigma) ? 1 : 0;
    }
    CAPTURE(sigma, found);
    CHECK(found > 15);  // 40 are expected, standard deviation 6.3
    CHECK(found < 65);
  }
}

TEST_CASE("the drift monitor knows the radius of a reference only if all its probes have one") {
  MonitorDesign design;
  design.reference_probes = 3;
  DriftMonitor monitor(design);
  monitor.Update(Vec3(1e-3, 0, 0), 1e-3);
  monitor.Update(Vec3(1e-3, 0, 0), 2e-3);
  CHECK(monitor.reference_radius_m() == 0);
  monitor.Update(Vec3(1e-3, 0, 0), 3e-3);
  CHECK(monitor.reference_radius_m() == Approx(2e-3));
  monitor.Update(Vec3(1e-3, 0, 0), 9e-3);
  CHECK(monitor.reference_radius_m() == Approx(2e-3));
  monitor.Restart();
  monitor.Update(Vec3(1e-3, 0, 0), 1e-3);
  monitor.Update(Vec3(1e-3, 0, 0));
  monitor.Update(Vec3(1e-3, 0, 0), 1e-3);
  CHECK(monitor.reference_radius_m() == 0);
}

}  // namespace plumbline::radius_contradiction_test
