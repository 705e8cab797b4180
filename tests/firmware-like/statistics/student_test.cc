// Coverage factors against closed forms and the table of the GUM.
#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::student_test {

using plumbline::statistics::kTwoSigmaCoverage;
using plumbline::statistics::StudentCoverageFactor;

TEST_CASE("one and two degrees of freedom have closed forms") {
  // P(|t| <= k) = 2 atan(k) / pi, and k / sqrt(2 + k^2).
  for (const double coverage : {0.5, 0.9, kTwoSigmaCoverage, 0.99}) {
    CAPTURE(coverage);
    CHECK(StudentCoverageFactor(coverage, 1) ==
          Approx(std::tan(std::numbers::pi * coverage / 2)).epsilon(1e-10));
    CHECK(StudentCoverageFactor(coverage, 2) ==
          Approx(coverage * std::sqrt(2 / (1 - coverage * coverage))).epsilon(1e-10));
  }
}

TEST_CASE("coverage factors are those of GUM table G.2, column 95.45 %") {
  CHECK(StudentCoverageFactor(kTwoSigmaCoverage, 5) == Approx(2.65).margin(0.005));
  CHECK(StudentCoverageFactor(kTwoSigmaCoverage, 10) == Approx(2.28).margin(0.005));
  CHECK(StudentCoverageFactor(kTwoSigmaCoverage, 50) == Approx(2.05).margin(0.005));
  CHECK(StudentCoverageFactor(kTwoSigmaCoverage, std::numeric_limits<double>::infinity()) ==
        Approx(2).epsilon(1e-10));
}

}  // namespace plumbline::student_test
