#include "app/plant/answers/robust_statistics.h"

#include <catch2/catch.hpp>
#include <random>

namespace plumbline::robust_statistics_test {

using namespace plumbline::plant;

namespace {

/// Daily values with lag-1 autocorrelation `r`, standard deviation 1, a slope, and every tenth day
/// wild.
std::vector<DayValue> Series(std::mt19937& random, int days, double slope, double r = 0,
                             bool wild = false) {
  std::normal_distribution<double> normal;
  std::vector<DayValue> series;
  double last = normal(random);
  for (int day = 0; day < days; ++day) {
    last = r * last + std::sqrt(1 - r * r) * normal(random);
    series.push_back({double(day), slope * day + last + (wild && day % 10 == 3 ? 50 : 0), 0});
  }
  return series;
}

std::vector<DayValue> Days(std::vector<double> values) {
  std::vector<DayValue> days;
  for (const double value : values) days.push_back({double(days.size()), value, 0});
  return days;
}

}  // namespace

TEST_CASE("an exact line has its slope, and needs enough days") {
  std::vector<DayValue> line;
  for (int day = 0; day < kMinTrendDays; ++day) line.push_back({double(day), 0.5 * day, 0});
  const auto trend = TrendOf(line, 0);
  REQUIRE(trend);
  CHECK(trend->slope.value == Approx(0.5));
  CHECK(trend->slope.low == Approx(0.5));
  CHECK(trend->p < 0.001);
  line.pop_back();
  CHECK_FALSE(TrendOf(line, 0));
}

TEST_CASE("a step between models is no trend") {
  std::mt19937 random(3);
  auto series = Series(random, 40, 0);
  for (DayValue& day : series) {
    day.group = day.day >= 20;
    if (day.group == 1) day.value += 30;
  }
  CHECK(std::abs(TrendOf(series, 0)->slope.value) < 0.1);
  for (DayValue& day : series) day.group = 0;
  CHECK(TrendOf(series, 0)->slope.value > 0.5);
}

TEST_CASE("under no trend, tests reject about as often as they say; intervals hold the truth") {
  std::mt19937 random(7);
  for (const double r : {0.0, 0.5, 0.8}) {
    int rejected = 0, missed = 0, shifted = 0, far_out = 0;
    constexpr int kRuns = 1500;
    for (int run = 0; run < kRuns; ++run) {
      const auto trend = TrendOf(Series(random, 30, 0.02, r), r);
      missed += trend->slope.Excludes(0.02);
      const auto none = TrendOf(Series(random, 30, 0, r), r);
      rejected += none->p < 0.05;
      far_out += none->p < 0.001;
      const auto both = Series(random, 40, 0, r);
      const std::span<const DayValue> all(both);
      shifted += ShiftBetween(all.first(20), all.last(20), r)->p < 0.05;
    }
    CAPTURE(r, rejected, missed, shifted, far_out);
    CHECK(rejected <= 92);  // 5 % of 1500 is 75 ± 17 (95 %)
    CHECK(missed <= 92);
    CHECK(shifted <= 92);
    CHECK(rejected >= 40);
    CHECK(far_out <= 5);  // 1.5 are expected
  }
}

TEST_CASE("the autocorrelation of short series is estimated without bias, gaps or not") {
  std::mt19937 random(11);
  for (const bool weekdays_only : {false, true}) {
    for (const double r : {0.4, 0.7}) {
      double sum = 0;
      constexpr int kRuns = 800;
      for (int run = 0; run < kRuns; ++run) {
        auto series = Series(random, 60, 0.05, r);
        if (weekdays_only) {
          std::erase_if(series, [](const DayValue& day) { return std::lround(day.day) % 7 > 4; });
        }
        sum += AutocorrelationOf(series).value_or(0);
      }
      CAPTURE(weekdays_only, r);
      CHECK(sum / kRuns == Approx(r).margin(0.05));
    }
  }
  CHECK_FALSE(AutocorrelationOf(Series(random, 7, 0)));
}

TEST_CASE("a trend is found beside wild days") {
  std::mt19937 random(5);
  const auto trend = TrendOf(Series(random, 60, 0.1, 0, true), 0);
  CHECK(trend->p < 1e-4);
  CHECK(trend->slope.value == Approx(0.1).margin(0.04));
  CHECK_FALSE(trend->slope.Excludes(0.1));
}

TEST_CASE("the shift of two samples is the median of all differences") {
  const auto shift = ShiftBetween(Days({3, 5, 1, 6, 2, 4}), Days({13, 15, 11, 16, 12, 14}), 0);
  REQUIRE(shift);
  CHECK(shift->difference.value == 10);
  CHECK(shift->difference.low > 0);
  CHECK(shift->p < 0.03);
  CHECK_FALSE(ShiftBetween(Days({1, 2, 3, 4}), Days({1, 2, 3, 4, 5}), 0));
  // Of 924 orders of 6 and 6 days, one has all later days above: no interval of 99.9 %.
  CHECK(ShiftBetween(Days({3, 5, 1, 6, 2, 4}), Days({13, 15, 11, 16, 12, 14}), 0, 0.999)
            ->difference.low < -1e300);
  // Equal values say nothing.
  CHECK(ShiftBetween(Days(std::vector<double>(8, 1.0)), Days(std::vector<double>(8, 1.0)), 0)->p ==
        1);
}

TEST_CASE("six values have an interval from least to largest; five have none") {
  const auto six = MedianWithInterval({3, 1, 2, 6, 5, 4});
  REQUIRE(six);
  CHECK(six->median.value == 3.5);
  CHECK(six->median.low == 1);
  CHECK(six->median.high == 6);
  CHECK(six->p == Approx(2.0 / 64));
  CHECK_FALSE(MedianWithInterval({1, 2, 3, 4, 5}));
  CHECK(MedianWithInterval({0, 0, 0, 0, 0, 0})->p == 1);
}

TEST_CASE("Holm's adjustment multiplies by the number of tests that are left") {
  const auto adjusted = HolmAdjusted(std::vector<double>{0.03, 0.01, 0.02, 0.9});
  CHECK(adjusted[1] == Approx(0.04));
  CHECK(adjusted[2] == Approx(0.06));
  CHECK(adjusted[0] == Approx(0.06));
  CHECK(adjusted[3] == Approx(0.9));
}

}  // namespace plumbline::robust_statistics_test
