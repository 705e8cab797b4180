#include <catch2/catch.hpp>
#include <cmath>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::chi_square_test {

using namespace plumbline::statistics;

namespace {

/// P(chi^2_n > x) for even n in closed form: e^(-x/2) sum_(k < n/2) (x/2)^k / k!.
double EvenTail(double x, int n) {
  double term = std::exp(-x / 2), sum = 0;
  for (int k = 0; k < n / 2; ++k) {
    sum += term;
    term *= x / 2 / (k + 1);
  }
  return sum;
}

}  // namespace

TEST_CASE("the tail of chi^2 matches the closed forms") {
  for (const double x : {0.1, 1.0, 4.0, 20.0, 60.0}) {
    CAPTURE(x);
    CHECK(ChiSquareTail(x, 1) == Approx(std::erfc(std::sqrt(x / 2))).epsilon(1e-9));
    for (const int n : {2, 8, 40}) {
      CAPTURE(n);
      CHECK(ChiSquareTail(x, n) == Approx(EvenTail(x, n)).epsilon(1e-9));
    }
  }
  CHECK(ChiSquareTail(0, 3) == 1);
  CHECK(ChiSquareTail(-1, 3) == 1);
}

TEST_CASE("the quantile of chi^2 is exceeded with the given probability") {
  CHECK(ChiSquareQuantile(0.05, 3) == Approx(7.814727903).epsilon(1e-9));  // printed tables
  for (const double tail : {0.5, 0.05, 1e-5, 1e-9}) {
    for (const int n : {2, 8, 40, 400}) {
      CAPTURE(tail, n);
      CHECK(EvenTail(ChiSquareQuantile(tail, n), n) == Approx(tail).epsilon(1e-6));
    }
  }
}

TEST_CASE("the approximate quantile of chi^2 is within 2.5 % at a tail of 5 %") {
  for (int tenth = 10; tenth < 1000; ++tenth) {
    const double n = 0.1 * tenth;
    CAPTURE(n);
    CHECK(ChiSquareQuantileNear(kNormal95, n) == Approx(ChiSquareQuantile(0.05, n)).epsilon(0.025));
  }
}

}  // namespace plumbline::chi_square_test
