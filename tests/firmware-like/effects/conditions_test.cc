#include <catch2/catch.hpp>

#include "tests/firmware-like/effects/small_cell.h"

namespace plumbline::conditions_test {

using namespace plumbline::effects;

namespace {

constexpr double kDeg = 57.29577951308232;

TEST_CASE("Conditions return the value of each file column in file units") {
  const Conditions moment = KnownMoment();
  const std::vector<std::pair<std::string, double>> cases = {
      {"t_s", 600},          {"temp_C", 25},
      {"payload_kg", 40},    {"row", 7},
      {"air_hPa", 1013},     {"q3_deg", -0.2 * kDeg},
      {"q3_mm", -200},       {"qd2_deg_s", 0.3 * kDeg},
      {"qd2_mm_s", 300},     {"qdd1_deg_s2", -2 * kDeg},
      {"qdd1_mm_s2", -2000}, {"tau6_Nm", 20},
  };
  for (const auto& [column, value] : cases) {
    CAPTURE(column);
    REQUIRE(moment.Signal(column));
    CHECK(*moment.Signal(column) == Approx(value).epsilon(1e-12));
  }
}

TEST_CASE("Unknown values are absent, never zero") {
  const Conditions nothing;
  for (const char* column : {"t_s", "temp_C", "row", "q1_deg", "qd1_deg_s", "qdd1_deg_s2",
                             "tau1_Nm", "air_hPa", "", "q_deg", "q0_deg", "qx_deg"}) {
    CAPTURE(column);
    CHECK_FALSE(nothing.Signal(column));
  }
  CHECK_FALSE(KnownMoment().Signal("q7_deg"));
  CHECK_FALSE(KnownMoment().Signal("air"));
}

}  // namespace
}  // namespace plumbline::conditions_test
