#include "app/siblings/random_effects.h"

#include <algorithm>
#include <cmath>

namespace plumbline::siblings {
namespace {

/// Weighted mean and the sums of its weights and of their squares.
struct WeightedMean {
  double mean = 0, weights = 0, squares = 0;
};

WeightedMean MeanOf(std::span<const Estimate> estimates, double between_variance) {
  WeightedMean of;
  for (const Estimate& estimate : estimates) {
    const double weight = 1 / (estimate.sd * estimate.sd + between_variance);
    of.weights += weight;
    of.squares += weight * weight;
    of.mean += weight * estimate.value;
  }
  of.mean /= of.weights;
  return of;
}

}  // namespace

double Pooled::next_sd() const {
  return std::hypot(between_sd, mean_sd);
}

std::optional<Pooled> PoolEstimates(std::span<const Estimate> estimates) {
  if (estimates.size() < 2) return std::nullopt;
  const WeightedMean fixed = MeanOf(estimates, 0);
  double excess = -static_cast<double>(estimates.size() - 1);
  for (const Estimate& estimate : estimates) {
    excess += std::pow((estimate.value - fixed.mean) / estimate.sd, 2);
  }
  double variance = std::max(0.0, excess) / (fixed.weights - fixed.squares / fixed.weights);
  variance = std::max(variance, std::pow(kLeastSpread * fixed.mean, 2));
  const WeightedMean random = MeanOf(estimates, variance);
  return Pooled{random.mean, std::sqrt(variance), 1 / std::sqrt(random.weights),
                static_cast<int>(estimates.size())};
}

}  // namespace plumbline::siblings
