// Prior for the sizes of effects from measured siblings, and its update by the rows of an arm.
#pragma once

#include <string>
#include <vector>

#include "app/measure/siblings/arm_fit.h"

namespace plumbline::measure {

/// Prior of one size: the estimate pooled over the siblings.
struct SizePrior {
  SizeKey key;
  Pooled pooled;
};

/// Sizes that at least two, and at least half, of the arms show, fitted jointly in every arm, so
/// that arms in which a size was not selected take part, too. With them come the sizes that every
/// arm has of its own (EffectTraits::zero_mean_over_arms), with mean zero and one spread for all
/// joints: its upper 80 % limit, so that they are usually included even if the siblings have none.
/// @param notes  receives a sentence for each arm in which they cannot be fitted
std::vector<SizePrior> PriorFrom(const std::vector<Arm>& arms, int threads,
                                 std::vector<std::string>& notes);

/// The effects at their mean, with the spread of a further arm as covariance.
std::vector<effects::ActiveEffect> MeanEffectsOf(const std::vector<SizePrior>& prior,
                                                 const model::CellModel& cell);

/// The prior updated by the rows of an arm: precision-weighted mean of the pooled sizes and a least
/// squares fit of all of them. Sizes that the rows do not determine keep their prior.
struct Posterior {
  /// With the covariance within each effect; that between sizes of different effects is lost.
  std::vector<effects::ActiveEffect> effects;
  double parameters = 0;  ///< effective number of fitted ones
  /// Probability that an arm of this model differs from its siblings by as much as the rows show:
  /// tail of chi-square of the fitted sizes about their prior, under both covariances.
  double p_value = 1;
};
Result<Posterior> UpdatedBy(const Arm& arm, const std::vector<SizePrior>& prior, int threads);

}  // namespace plumbline::measure
