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

/// Bound of autocorrelations: a series beyond has no trend that its noise could not have.
inline constexpr double kMostAutocorrelation = 0.95;

/// Correlation of neighbouring days, per day, of one series without its trend; corrected for the
/// bias of short series [Marriott & Pope 1954, Biometrika 41:390]. Between 0 and
/// kMostAutocorrelation.
/// @param values  in order of day
/// @return        nullopt if there are too few
std::optional<double> AutocorrelationOf(std::span<const DayValue> values);

struct Trend {
  int days = 0;
  Interval slope;      ///< per day
  double p = 1;        ///< two-sided, of no trend
  double least_p = 1;  ///< what a series that only rises would reach with these days
};

/// Theil-Sen slope: the median of the slopes of all pairs of days in the same group
/// [Sen 1968, JASA 63:1379], with Mann-Kendall's test of no monotonic trend, summed over the groups
/// [Hirsch & Slack 1984, Water Resour. Res. 20:727]. Neighbouring days resemble each other: both
/// are computed from (y_t - r^d y_(t-d)) / (1 - r^d), d the days since the one before, which have
/// the level and the trend of y and are independent if y is autoregressive with r
/// [von Storch 1995, Analysis of Climate Variability, ch. 2]. So the tail of the test is that of
/// independent days, however small p is.
/// @param values           in order of day
/// @param autocorrelation  r; too large a value costs power, too small a one makes p too small
/// @return                 nullopt if no group has kMinTrendDays
std::optional<Trend> TrendOf(std::span<const DayValue> values, double autocorrelation,
                             double confidence = 0.95);

struct Shift {
  int days_before = 0, days_after = 0;
  Interval difference;  ///< after minus before; unbounded if so few days have no such confidence
  double p = 1;         ///< two-sided, of no difference
};

/// Hodges-Lehmann difference of two samples: the median of all differences, with the rank sum test
/// of Mann and Whitney [Hollander & Wolfe, Nonparametric Statistical Methods, ch. 4], of days made
/// independent as in TrendOf().
/// @param before, after  in order of day
/// @return               nullopt if one of them has fewer than kMinShiftDays
std::optional<Shift> ShiftBetween(std::span<const DayValue> before, std::span<const DayValue> after,
                                  double autocorrelation, double confidence = 0.95);

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
