#include "app/measure/siblings/random_effects.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/statistics/chi_square.h"

namespace plumbline::measure {
namespace {

constexpr double kConfidence = 0.8;
constexpr double kContradicted = 0.01;
constexpr double kMinDeviations = 3;  // of a mean from zero

struct WeightedMean {
  double mean = 0, weights = 0;
  double squares = 0;  ///< weighted sum of squares about the mean
};

WeightedMean MeanOf(std::span<const Estimate> estimates, double between_variance) {
  WeightedMean of;
  const auto weight = [between_variance](const Estimate& estimate) {
    return 1 / (estimate.sd * estimate.sd + between_variance);
  };
  for (const Estimate& estimate : estimates) {
    of.weights += weight(estimate);
    of.mean += weight(estimate) * estimate.value;
  }
  of.mean /= of.weights;
  for (const Estimate& estimate : estimates) {
    of.squares += weight(estimate) * std::pow(estimate.value - of.mean, 2);
  }
  return of;
}

/// Where a decreasing function falls to `limit`, between `low` and a bound that is doubled from
/// `high` on; `low` if it is below the limit there already.
template <typename Decreasing>
double RootOf(const Decreasing& function, double limit, double low, double high) {
  if (function(low) <= limit) return low;
  for (int k = 0; k < 200 && function(high) > limit; ++k) high *= 2;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    const double middle = (low + high) / 2;
    (function(middle) > limit ? low : high) = middle;
  }
  return high;
}

double SumOfVariances(std::span<const Estimate> estimates) {
  double sum = 0;
  for (const Estimate& estimate : estimates) sum += estimate.sd * estimate.sd;
  return sum;
}

/// The spread's variance at which the weighted squares fall to `squares`; 0 if they are below
/// already.
double VarianceWith(std::span<const Estimate> estimates, double squares) {
  return RootOf([&](double variance) { return MeanOf(estimates, variance).squares; }, squares, 0,
                SumOfVariances(estimates));
}

/// Estimates of one quantity with their mean.
struct Quantity {
  std::vector<Estimate> estimates;
  double mean = 0;
  std::size_t place = 0;  ///< among all
};

double FreedomOf(const std::vector<Quantity>& quantities) {
  double freedom = 0;
  for (const Quantity& one : quantities) freedom += static_cast<double>(one.estimates.size() - 1);
  return freedom;
}

double SquaresWith(const Quantity& quantity, double spread) {
  return MeanOf(quantity.estimates, std::pow(spread * quantity.mean, 2)).squares;
}

/// The upper limit of their common spread.
double SpreadOf(const std::vector<Quantity>& quantities) {
  const double limit = statistics::ChiSquareQuantile(kConfidence, FreedomOf(quantities));
  return RootOf(
      [&](double spread) {
        double squares = 0;
        for (const Quantity& one : quantities) squares += SquaresWith(one, spread);
        return squares;
      },
      limit, kLeastCommonSpread, 2 * kLeastCommonSpread);
}

/// Squares of a quantity with the spread of the others, in units of what contradicts that.
double Excess(const Quantity& quantity, const std::vector<Quantity>& all) {
  std::vector<Quantity> others;
  for (const Quantity& one : all) {
    if (&one != &quantity) others.push_back(one);
  }
  if (others.empty()) return 0;
  const auto freedom = static_cast<double>(quantity.estimates.size() - 1);
  return SquaresWith(quantity, SpreadOf(others)) /
         statistics::ChiSquareQuantile(kContradicted / static_cast<double>(all.size()), freedom);
}

}  // namespace

double Pooled::next_sd() const {
  return std::hypot(between_sd, mean_sd);
}

std::optional<Pooled> PoolEstimates(std::span<const Estimate> estimates,
                                    std::optional<double> common) {
  if (estimates.size() < 2) return std::nullopt;
  const auto freedom = static_cast<double>(estimates.size() - 1);
  double variance = 0;
  if (common) {
    variance = std::pow(*common * MeanOf(estimates, 0).mean, 2);
  } else {
    variance = VarianceWith(estimates, statistics::ChiSquareQuantile(kConfidence, freedom));
    variance = std::max(variance, std::pow(kLeastSpread * MeanOf(estimates, variance).mean, 2));
  }
  const WeightedMean of = MeanOf(estimates, variance);
  return Pooled{of.mean, std::sqrt(variance), 1 / std::sqrt(of.weights),
                static_cast<int>(estimates.size())};
}

std::optional<CommonSpread> CommonSpreadOf(std::span<const std::vector<Estimate>> quantities) {
  std::vector<Quantity> counted;
  for (std::size_t k = 0; k < quantities.size(); ++k) {
    if (quantities[k].size() < 2) continue;
    const WeightedMean of = MeanOf(quantities[k], 0);
    if (std::abs(of.mean) < kMinDeviations / std::sqrt(of.weights)) continue;
    counted.push_back({quantities[k], of.mean, k});
  }
  while (FreedomOf(counted) >= kMinCommonFreedom) {
    const auto worst =
        std::max_element(counted.begin(), counted.end(), [&](const Quantity& a, const Quantity& b) {
          return Excess(a, counted) < Excess(b, counted);
        });
    if (Excess(*worst, counted) > 1) {
      counted.erase(worst);
      continue;
    }
    CommonSpread common{SpreadOf(counted), std::vector<bool>(quantities.size(), false)};
    for (const Quantity& one : counted) common.shared_by[one.place] = true;
    return common;
  }
  return std::nullopt;
}

double SpreadAboutZero(std::span<const Estimate> estimates) {
  if (estimates.empty()) return 0;
  const auto squares = [&](double variance) {
    double sum = 0;
    for (const Estimate& one : estimates)
      sum += one.value * one.value / (one.sd * one.sd + variance);
    return sum;
  };
  return std::sqrt(RootOf(
      squares, statistics::ChiSquareQuantile(kConfidence, static_cast<double>(estimates.size())), 0,
      SumOfVariances(estimates)));
}

}  // namespace plumbline::measure
