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
  std::vector<std::pair<const std::vector<Estimate>*, double>> counted;  // with their mean
  double freedom = 0;
  for (const std::vector<Estimate>& estimates : quantities) {
    if (estimates.size() < 2) continue;
    const WeightedMean of = MeanOf(estimates, 0);
    if (std::abs(of.mean) < kMinDeviations / std::sqrt(of.weights)) continue;
    counted.emplace_back(&estimates, of.mean);
    freedom += static_cast<double>(estimates.size() - 1);
  }
  if (freedom < kMinCommonFreedom) return std::nullopt;
  const double limit = statistics::ChiSquareQuantile(kConfidence, freedom);
  const auto exceeds = [&](double spread) {
    double squares = 0;
    for (const auto& [estimates, mean] : counted)
      squares += MeanOf(*estimates, std::pow(spread * mean, 2)).squares;
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

}  // namespace plumbline::siblings
