// Start and end of interference with a jittering distance.
#include "firmware-like/scene/interference_watch.h"

#include <catch2/catch.hpp>
#include <limits>
#include <vector>

namespace plumbline::interference_watch_test {

using namespace plumbline::scene;

namespace {

struct Told {
  double distance_m;
  Proximity state;
  bool operator==(const Told&) const = default;
};

std::vector<Told> Follow(InterferenceWatch& watch, const std::vector<double>& distances_m) {
  std::vector<Told> told;
  for (const double d : distances_m) {
    if (const auto state = watch.Update(d)) told.push_back({d, *state});
  }
  return told;
}

}  // namespace

TEST_CASE("interference starts at contact and ends beyond the hysteresis, once each") {
  InterferenceWatch watch({.near_m = 0, .end_m = 1e-3});
  const auto told = Follow(watch, {1, 0.01, 1e-4, 0, 5e-4, 0, 9e-4, 1e-3, 1.1e-3, 5e-4, 1e-6, 0});
  CHECK(told == std::vector<Told>{{0, Proximity::kInterference},
                                  {1.1e-3, Proximity::kApart},
                                  {0, Proximity::kInterference}});
}

TEST_CASE("proximity is reported before and after interference") {
  InterferenceWatch watch({.near_m = 0.02, .end_m = 1e-3});
  const auto told = Follow(watch, {0.1, 0.0205, 0.02, 0.0205, 0, 5e-4, 0.002, 0.0209, 0.0211});
  CHECK(told == std::vector<Told>{{0.02, Proximity::kNear},
                                  {0, Proximity::kInterference},
                                  {0.002, Proximity::kNear},
                                  {0.0211, Proximity::kApart}});
  InterferenceWatch sudden({.near_m = 0.02, .end_m = 1e-3});
  CHECK(Follow(sudden, {1, 0, 1}).size() == 2);
}

TEST_CASE("a missing distance changes nothing") {
  InterferenceWatch watch({.near_m = 0, .end_m = 1e-3});
  CHECK_FALSE(watch.measured());
  CHECK(watch.Update(0.0) == Proximity::kInterference);
  CHECK(watch.measured());
  for (const std::optional<double> nothing :
       {std::optional<double>(), std::optional(std::numeric_limits<double>::quiet_NaN()),
        std::optional(std::numeric_limits<double>::infinity())}) {
    CHECK_FALSE(watch.Update(nothing));
    CHECK_FALSE(watch.measured());
    CHECK(watch.state() == Proximity::kInterference);
  }
}

}  // namespace plumbline::interference_watch_test
