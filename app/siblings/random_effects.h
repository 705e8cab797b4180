// Random-effects meta-analysis: what several arms of one model have in common in one number.
#pragma once

#include <optional>
#include <span>

namespace plumbline::siblings {

struct Estimate {
  double value = 0;
  double sd = 0;  ///< of the measurement alone, > 0
};

/// Distribution of a number over the arms of a model: normal with this mean and spread.
struct Pooled {
  double mean = 0;
  double between_sd = 0;  ///< from arm to arm
  double mean_sd = 0;     ///< of `mean`
  int arms = 0;

  /// Standard deviation of the value of a further arm about `mean`.
  double next_sd() const;
};

/// The estimator of DerSimonian and Laird (1986): value_i = mean + b_i + e_i, with var(b_i) from
/// the excess of the estimates' scatter over their own uncertainty. Few arms often show no excess
/// by chance, so that between_sd is at least kLeastSpread of the mean.
/// @return  nullopt with fewer than two estimates
std::optional<Pooled> PoolEstimates(std::span<const Estimate> estimates);

/// Judgement: arms of one model differ at least by this share.
inline constexpr double kLeastSpread = 0.1;

}  // namespace plumbline::siblings
