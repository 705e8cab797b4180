// Trends, shifts and levels of daily values by rank statistics, which a few wild days do not move.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace plumbline::plant {

/// Estimate with the bounds of its confidence interval.
struct Interval {
  double value = 0, low = 0, high = 0;
  bool Excludes(double other) const { return low > other || high < other; }
};

/// One day's value. Days of different groups (models in force) are never compared with each other.
struct DayValue {
  double day = 0;
  double value = 0;
  int group = 0;
};

/// Days of one group below which nothing is said about a trend.
inline constexpr int kMinTrendDays = 10;
/// Days on each side below which nothing is said about a shift.
inline constexpr int kMinShiftDays = 5;
/// Cells below which a group of them has no interval: the signs of five reach only 6 %.
inline constexpr int kMinGroupCells = 6;

struct Trend {
  int days = 0;
  Interval slope;  ///< per day
  double p = 1;    ///< two-sided, of no trend
};

/// Theil-Sen slope: the median of the slopes of all pairs of days in the same group
/// [Sen 1968, JASA 63:1379], with Mann-Kendall's test of no monotonic trend, summed over the groups
/// [Hirsch & Slack 1984, Water Resour. Res. 20:727]. Neighbouring days resemble each other: the
/// variance of Kendall's S is multiplied by (1 + r) / (1 - r), r the lag-1 autocorrelation of the
/// values without their trend, if positive [Yue & Wang 2004, Water Resour. Manag. 18:201].
/// @param values  in order of day
/// @return        nullopt if no group has kMinTrendDays
std::optional<Trend> TrendOf(std::span<const DayValue> values, double confidence = 0.95);

struct Shift {
  int days_before = 0, days_after = 0;
  Interval difference;  ///< after minus before
  double p = 1;         ///< two-sided, of no difference
};

/// Hodges-Lehmann difference of two samples: the median of all differences, with the rank sum test
/// of Mann and Whitney [Hollander & Wolfe, Nonparametric Statistical Methods, ch. 4]. The variance
/// is enlarged for neighbouring days as in TrendOf().
/// @param before, after  in order of day
/// @return               nullopt if one of them has fewer than kMinShiftDays
std::optional<Shift> ShiftBetween(std::span<const double> before, std::span<const double> after,
                                  double confidence = 0.95);

struct GroupMedian {
  Interval median;  ///< 95 % or a little more
  double p = 1;     ///< two-sided sign test of a median of 0
};

/// Median of the values with the interval between two order statistics, which assumes nothing of
/// their distribution. @return  nullopt below kMinGroupCells
std::optional<GroupMedian> MedianWithInterval(std::vector<double> values);

/// Holm's adjustment for several tests: the probability that even one of the hypotheses at or below
/// the adjusted value is rejected wrongly is at most that value [Holm 1979, Scand. J. Stat. 6:65].
std::vector<double> HolmAdjusted(std::span<const double> p);

}  // namespace plumbline::plant
