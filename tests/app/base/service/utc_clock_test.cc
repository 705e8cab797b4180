#include "app/base/service/utc_clock.h"

#include <catch2/catch.hpp>

namespace plumbline::utc_clock_test {

using namespace plumbline::service;

TEST_CASE("UTC advances without steps, and a step of the system clock is reported once") {
  UtcClock clock(1.8e9, 1000);
  CHECK(clock.UtcAt(1000) == 1.8e9);
  CHECK(clock.UtcAt(1060.5) == 1.8e9 + 60.5);
  CHECK_FALSE(clock.DetectStep(1.8e9 + 60.9, 1060));  // a time service's small correction
  CHECK(clock.DetectStep(1.8e9 + 3660, 1060) == Approx(3600));
  CHECK_FALSE(clock.DetectStep(1.8e9 + 3670, 1070));
  CHECK(clock.UtcAt(1070) == 1.8e9 + 70);  // not taken up
  CHECK(clock.DetectStep(1.8e9 + 80, 1080) == Approx(-3600));
  CHECK_FALSE(clock.DetectStep(1.8e9 + 90, 1090));
}

}  // namespace plumbline::utc_clock_test
