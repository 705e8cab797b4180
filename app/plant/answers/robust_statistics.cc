#include "app/plant/answers/robust_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::plant {
namespace {

constexpr double kMostAutocorrelation = 0.9;

/// z with P(|normal| <= z) = confidence.
double NormalFactor(double confidence) {
  return statistics::StudentCoverageFactor(confidence, std::numeric_limits<double>::infinity());
}

double Median(std::vector<double> values) {
  return statistics::MedianOf(values);
}

double TwoSided(double z) {
  return std::erfc(std::abs(z) / std::sqrt(2.0));
}

/// Sum of f(t) over the sizes t of sets of equal values.
template <typename F>
double OverTies(std::vector<double> values, F f) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (auto at = values.begin(); at != values.end();) {
    const auto end = std::upper_bound(at, values.end(), *at);
    sum += f(static_cast<double>(end - at));
    at = end;
  }
  return sum;
}

/// Factor by which the variance of a rank statistic grows because neighbours resemble each other.
double Inflation(double products, double squares) {
  if (squares <= 0) return 1;
  const double r = std::clamp(products / squares, 0.0, kMostAutocorrelation);
  return (1 + r) / (1 - r);
}

/// Adds lag-1 products and squares of one series about its median.
void AddAutocorrelation(std::span<const double> values, double& products, double& squares) {
  const double middle = Median({values.begin(), values.end()});
  for (std::size_t k = 0; k < values.size(); ++k) {
    squares += (values[k] - middle) * (values[k] - middle);
    if (k > 0) products += (values[k] - middle) * (values[k - 1] - middle);
  }
}

/// The value at a place of the sorted values; the first or the last if it lies outside. Selects in
/// linear time, since a year of days has 65,000 slopes.
double AtPlace(std::vector<double>& values, double place) {
  const double last = static_cast<double>(values.size()) - 1;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::clamp(place, 0.0, last));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Median of differences or slopes, with the interval of `half` places on either side.
Interval IntervalAbout(std::vector<double> all, double half) {
  const double count = static_cast<double>(all.size());
  Interval interval;
  interval.value = statistics::MedianOf(all);
  interval.low = AtPlace(all, std::floor((count - half) / 2) - 1);
  interval.high = AtPlace(all, std::ceil((count + half) / 2));
  return interval;
}

}  // namespace

std::optional<Trend> TrendOf(std::span<const DayValue> values, double confidence) {
  std::map<int, std::vector<DayValue>> groups;
  for (const DayValue& value : values) groups[value.group].push_back(value);
  std::erase_if(groups, [](const auto& group) { return group.second.size() < 2; });
  std::size_t longest = 0;
  Trend trend;
  std::vector<double> slopes;
  double sum = 0, variance = 0;
  for (const auto& [group, days] : groups) {
    longest = std::max(longest, days.size());
    trend.days += static_cast<int>(days.size());
    for (std::size_t i = 0; i < days.size(); ++i) {
      for (std::size_t k = i + 1; k < days.size(); ++k) {
        const double rise = days[k].value - days[i].value;
        if (days[k].day > days[i].day) slopes.push_back(rise / (days[k].day - days[i].day));
        sum += (rise > 0) - (rise < 0);
      }
    }
    const auto term = [](double n) { return n * (n - 1) * (2 * n + 5) / 18; };
    std::vector<double> plain;
    for (const DayValue& day : days) plain.push_back(day.value);
    variance += term(static_cast<double>(days.size())) - OverTies(plain, term);
  }
  if (longest < kMinTrendDays || slopes.empty()) return std::nullopt;
  const double slope = Median(slopes);
  double products = 0, squares = 0;
  for (const auto& [group, days] : groups) {
    std::vector<double> left;
    for (const DayValue& day : days) left.push_back(day.value - slope * day.day);
    AddAutocorrelation(left, products, squares);
  }
  const double deviation = std::sqrt(variance * Inflation(products, squares));
  if (deviation > 0) trend.p = TwoSided(std::max(0.0, std::abs(sum) - 1) / deviation);
  trend.slope = IntervalAbout(std::move(slopes), NormalFactor(confidence) * deviation);
  return trend;
}

std::optional<Shift> ShiftBetween(std::span<const double> before, std::span<const double> after,
                                  double confidence) {
  const auto m = static_cast<double>(before.size()), n = static_cast<double>(after.size());
  if (std::min(m, n) < kMinShiftDays) return std::nullopt;
  Shift shift{static_cast<int>(before.size()), static_cast<int>(after.size()), {}, 1};
  std::vector<double> differences;
  double above = 0;  // pairs in which `after` is larger
  for (const double b : before) {
    for (const double a : after) {
      differences.push_back(a - b);
      above += a > b ? 1 : a == b ? 0.5 : 0;
    }
  }
  std::vector<double> all(before.begin(), before.end());
  all.insert(all.end(), after.begin(), after.end());
  const double ties = OverTies(all, [](double t) { return t * t * t - t; });
  double products = 0, squares = 0;
  AddAutocorrelation(before, products, squares);
  AddAutocorrelation(after, products, squares);
  const double variance =
      m * n / 12 * (m + n + 1 - ties / ((m + n) * (m + n - 1))) * Inflation(products, squares);
  if (variance > 0) {
    const double off = std::max(0.0, std::abs(above - m * n / 2) - 0.5);
    shift.p = TwoSided(off / std::sqrt(variance));
  }
  shift.difference =
      IntervalAbout(std::move(differences), 2 * NormalFactor(confidence) * std::sqrt(variance));
  return shift;
}

std::optional<GroupMedian> MedianWithInterval(std::vector<double> values) {
  const int n = static_cast<int>(values.size());
  if (n < kMinGroupCells) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto probability = [n](int k) {  // of k heads among n
    return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) -
                    n * std::log(2.0));
  };
  int outside = 0;  // order statistics left out on each side
  double tail = probability(0);
  while (tail + probability(outside + 1) <= 0.025) tail += probability(++outside);
  GroupMedian result;
  result.median = {Median(values), values[static_cast<std::size_t>(outside)],
                   values[static_cast<std::size_t>(n - 1 - outside)]};
  const auto positive =
      static_cast<int>(std::count_if(values.begin(), values.end(), [](double v) { return v > 0; }));
  const auto negative =
      static_cast<int>(std::count_if(values.begin(), values.end(), [](double v) { return v < 0; }));
  // Zeros count for neither side, and so against a difference.
  double beyond = 0;
  for (int k = 0; k <= n - std::max(positive, negative); ++k) beyond += probability(k);
  result.p = std::min(1.0, 2 * beyond);
  return result;
}

std::vector<double> HolmAdjusted(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(p.size() - k) * p[order[k]]));
    adjusted[order[k]] = largest;
  }
  return adjusted;
}

}  // namespace plumbline::plant
