#include "app/siblings/random_effects.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware-like/statistics/chi_square.h"

namespace plumbline::siblings {
namespace {

constexpr double kConfidence = 0.8;
constexpr double kContradicted = 0.01;
constexpr double kMinDeviations = 3;  // of a mean from zero
constexpr double kMostSpread = 10;    // ends the search

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

/// The spread's variance at which the weighted squares fall to `squares`; 0 if they are below
/// already.
double VarianceWith(std::span<const Estimate> estimates, double squares) {
  if (MeanOf(estimates, 0).squares <= squares) return 0;
  double low = 0, high = 0;
  for (const Estimate& estimate : estimates) high += estimate.sd * estimate.sd;
  while (MeanOf(estimates, high).squares > squares) high *= 4;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    const double middle = (low + high) / 2;
    (MeanOf(estimates, middle).squares > squares ? low : high) = middle;
  }
  return high;
}

/// Estimates of one quantity with their mean.
struct Quantity {
  std::vector<Estimate> estimates;
  double mean = 0;
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
  const auto exceeds = [&](double spread) {
    double squares = 0;
    for (const Quantity& one : quantities) squares += SquaresWith(one, spread);
    return squares > limit;
  };
  double low = kLeastCommonSpread, high = low;
  while (exceeds(high) && high < kMostSpread) high *= 2;
  while (high - low > 1e-6) {
    const double middle = (low + high) / 2;
    (exceeds(middle) ? low : high) = middle;
  }
  return high;
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
  const double of_common = std::pow(common.value_or(0) * MeanOf(estimates, 0).mean, 2);
  double variance = of_common;
  if (!common || MeanOf(estimates, of_common).squares >
                     statistics::ChiSquareQuantile(kContradicted, freedom)) {
    variance = VarianceWith(estimates, statistics::ChiSquareQuantile(kConfidence, freedom));
    variance = std::max(variance, std::pow(kLeastSpread * MeanOf(estimates, variance).mean, 2));
  }
  const WeightedMean of = MeanOf(estimates, variance);
  return Pooled{of.mean, std::sqrt(variance), 1 / std::sqrt(of.weights),
                static_cast<int>(estimates.size())};
}

std::optional<double> CommonSpread(std::span<const std::vector<Estimate>> quantities) {
  std::vector<Quantity> counted;
  for (const std::vector<Estimate>& estimates : quantities) {
    if (estimates.size() < 2) continue;
    const WeightedMean of = MeanOf(estimates, 0);
    if (std::abs(of.mean) < kMinDeviations / std::sqrt(of.weights)) continue;
    counted.push_back({estimates, of.mean});
  }
  while (FreedomOf(counted) >= kMinCommonFreedom) {
    const auto worst =
        std::max_element(counted.begin(), counted.end(), [&](const Quantity& a, const Quantity& b) {
          return Excess(a, counted) < Excess(b, counted);
        });
    if (Excess(*worst, counted) <= 1) return SpreadOf(counted);
    counted.erase(worst);
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
  const double limit =
      statistics::ChiSquareQuantile(kConfidence, static_cast<double>(estimates.size()));
  if (squares(0) <= limit) return 0;
  double low = 0, high = 0;
  for (const Estimate& one : estimates) high += one.value * one.value / limit;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    const double middle = (low + high) / 2;
    (squares(middle) > limit ? low : high) = middle;
  }
  return std::sqrt(high);
}

}  // namespace plumbline::siblings
