#include "app/plant/answers/robust_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::plant {
namespace {

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

/// Days of the same group, in order; groups of one day say nothing.
std::map<int, std::vector<DayValue>> GroupsOf(std::span<const DayValue> values) {
  std::map<int, std::vector<DayValue>> groups;
  for (const DayValue& value : values) groups[value.group].push_back(value);
  std::erase_if(groups, [](const auto& group) { return group.second.size() < 2; });
  return groups;
}

void AddSlopes(const std::vector<DayValue>& days, std::vector<double>& slopes) {
  for (std::size_t i = 0; i < days.size(); ++i) {
    for (std::size_t k = i + 1; k < days.size(); ++k) {
      const double apart = days[k].day - days[i].day;
      if (apart > 0) slopes.push_back((days[k].value - days[i].value) / apart);
    }
  }
}

/// Values of the same level and trend that are independent of each other.
std::vector<DayValue> Whitened(std::span<const DayValue> days, double autocorrelation) {
  if (autocorrelation <= 0) return {days.begin(), days.end()};
  std::vector<DayValue> white;
  for (std::size_t k = 1; k < days.size(); ++k) {
    const DayValue &before = days[k - 1], &day = days[k];
    const double r = std::pow(autocorrelation, std::max(1.0, day.day - before.day));
    white.push_back({(day.day - r * before.day) / (1 - r), (day.value - r * before.value) / (1 - r),
                     day.group});
  }
  return white;
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

std::optional<double> AutocorrelationOf(std::span<const DayValue> values) {
  const auto groups = GroupsOf(values);
  std::vector<double> slopes;
  for (const auto& [group, days] : groups) AddSlopes(days, slopes);
  if (slopes.empty()) return std::nullopt;
  const double slope = Median(slopes);
  double products = 0, squares = 0, pairs = 0, apart = 0, count = 0;
  for (const auto& [group, days] : groups) {
    double mean = 0;
    for (const DayValue& day : days) mean += day.value - slope * day.day;
    mean /= static_cast<double>(days.size());
    double before = 0;
    for (std::size_t k = 0; k < days.size(); ++k) {
      const double left = days[k].value - slope * days[k].day - mean;
      squares += left * left;
      ++count;
      if (k > 0) {
        products += left * before;
        apart += days[k].day - days[k - 1].day;
        ++pairs;
      }
      before = left;
    }
  }
  // The mean of each group and the slope take (1 + 3 r) and (1 + r) of n days off the estimate.
  const auto means = static_cast<double>(groups.size());
  const double least = 3 * means + 1;
  if (count < 2 * least || squares <= 0 || apart <= 0) return std::nullopt;
  const double plain = products / pairs / (squares / count);
  const double r = (plain + (means + 1) / count) / (1 - least / count);
  const double by_day = r > 0 ? std::pow(r, pairs / apart) : 0;
  return std::min(by_day, kMostAutocorrelation);
}

std::optional<Trend> TrendOf(std::span<const DayValue> values, double autocorrelation,
                             double confidence) {
  std::size_t longest = 0;
  Trend trend;
  std::vector<double> slopes;
  double sum = 0, most = 0, variance = 0;
  for (const auto& [group, days] : GroupsOf(values)) {
    longest = std::max(longest, days.size());
    trend.days += static_cast<int>(days.size());
    const std::vector<DayValue> white = Whitened(days, autocorrelation);
    AddSlopes(white, slopes);
    std::vector<double> plain;
    for (std::size_t k = 0; k < white.size(); ++k) {
      for (const double before : plain) {
        sum += (white[k].value > before) - (white[k].value < before);
      }
      most += static_cast<double>(k);
      plain.push_back(white[k].value);
    }
    const auto term = [](double n) { return n * (n - 1) * (2 * n + 5) / 18; };
    variance += term(static_cast<double>(white.size())) - OverTies(plain, term);
  }
  if (longest < kMinTrendDays || slopes.empty()) return std::nullopt;
  const double deviation = std::sqrt(variance);
  if (deviation > 0) {
    trend.p = TwoSided(std::max(0.0, std::abs(sum) - 1) / deviation);
    trend.least_p = TwoSided((most - 1) / deviation);
  }
  trend.slope = IntervalAbout(std::move(slopes), NormalFactor(confidence) * deviation);
  return trend;
}

std::optional<Shift> ShiftBetween(std::span<const DayValue> before, std::span<const DayValue> after,
                                  double autocorrelation, double confidence) {
  if (std::min(before.size(), after.size()) < kMinShiftDays) return std::nullopt;
  Shift shift{static_cast<int>(before.size()), static_cast<int>(after.size()), {}, 1};
  const std::vector<DayValue> sides[] = {Whitened(before, autocorrelation),
                                         Whitened(after, autocorrelation)};
  const auto m = static_cast<double>(sides[0].size()), n = static_cast<double>(sides[1].size());
  std::vector<double> differences, all;
  double above = 0;  // pairs in which `after` is larger
  for (const DayValue& b : sides[0]) {
    for (const DayValue& a : sides[1]) {
      differences.push_back(a.value - b.value);
      above += a.value > b.value ? 1 : a.value == b.value ? 0.5 : 0;
    }
  }
  for (const auto& side : sides) {
    for (const DayValue& day : side) all.push_back(day.value);
  }
  const double ties = OverTies(all, [](double t) { return t * t * t - t; });
  const double variance = m * n / 12 * (m + n + 1 - ties / ((m + n) * (m + n - 1)));
  if (variance > 0) {
    const double off = std::max(0.0, std::abs(above - m * n / 2) - 0.5);
    shift.p = TwoSided(off / std::sqrt(variance));
  }
  const double half = 2 * NormalFactor(confidence) * std::sqrt(variance);
  shift.difference = IntervalAbout(std::move(differences), half);
  // Beyond the least and the largest difference, whose exact confidence is known.
  const double separate =
      2 * std::exp(std::lgamma(m + 1) + std::lgamma(n + 1) - std::lgamma(m + n + 1));
  if (half > m * n - 2 && separate > 1 - confidence) {
    shift.difference.low = -std::numeric_limits<double>::infinity();
    shift.difference.high = std::numeric_limits<double>::infinity();
  }
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
