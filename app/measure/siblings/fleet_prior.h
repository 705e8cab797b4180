// Prior for the sizes of effects: their distribution over the arms of one model, and its update by
// the rows of a further arm.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/measure/siblings/arm_fit.h"

namespace plumbline::measure {

/// Prior of one size: the estimate pooled over the arms.
struct SizePrior {
  SizeKey key;
  Pooled pooled;
};

/// The sizes that are fitted jointly in every arm, so that arms in which one was not selected take
/// part, too.
struct AgreedSizes {
  std::vector<SizeKey> keys;
  /// The first ones are common to the arms; the others are those that every arm has of its own
  /// (EffectTraits::zero_mean_over_arms), of all revolute joints.
  std::size_t common = 0;
  bool operator==(const AgreedSizes&) const = default;
};

/// Common are the sizes that at least two, and at least half, of the arms show. Both parts are in
/// the order of the catalogue, words and joints, whatever the order of the arms.
/// @param cell  of any of the arms, which are declared alike (DifferenceOf)
/// @return      an error if there is no common one
Result<AgreedSizes> AgreeOnSizes(const std::vector<const ArmFindings*>& arms,
                                 const model::CellModel& cell);

/// The agreed sizes fitted to the rows of one arm.
struct ArmFit {
  std::string arm;
  SizeFit fit;
  std::vector<std::string> row_sketch = {};  ///< of its rows (repeated_rows.h)
};

/// An arm that the prior was not computed from.
struct LeftOutArm {
  std::string arm, reason;
};

/// What the arms of one model have in common.
struct FleetPrior {
  std::string model;    ///< as declared in [robot]; empty: arms given as folders
  std::string date;     ///< YYYY-MM-DD; empty likewise
  std::string created;  ///< UTC, "2026-11-30T07:30:00Z"; empty likewise
  AgreedSizes agreed;
  std::vector<ArmFit> arms;  ///< that `sizes` are pooled from
  std::vector<LeftOutArm> left_out;
  std::vector<SizePrior> sizes;
  /// The cell file of one of the arms, and its content, which a further arm is compared with; empty
  /// if it was compared already.
  std::string cell_text;
  model::CellModel cell;
  bool without_itself = false;  ///< the arm that it is used for was one of `arms`

  std::vector<std::string> ArmNames() const;
  /// "37 arms of KR 210 R2700-2, 2026-11-30", or "siblings arm-2, arm-3".
  std::string Source() const;
};

/// Probability that a further arm differs from its siblings by as much as its fit does: tail of
/// chi-square of the fitted sizes about their prior, under both covariances.
double ProbabilityOf(const SizeFit& fit, const std::vector<SizePrior>& prior);

/// Below this probability an arm counts as different from its siblings. The level is approximate:
/// the spread of few siblings is an upper limit, not known.
inline constexpr double kDifferentArm = 0.01;

/// Pools each size over the arms (PoolEstimates, CommonSpreadOf). Sizes that every arm has of its
/// own get mean zero and one spread for all joints: its upper 80 % limit, so that they are usually
/// included even if the arms show none. The arm that differs most from the prior of all others is
/// left out, and the next one, while its probability is below kDifferentArm over the number of arms
/// (Bonferroni: of 100 fleets of arms that are alike, one loses an arm).
/// @return  `arms`, `left_out` and `sizes`; an error if fewer than two arms remain, or not most
Result<FleetPrior> PoolFits(const AgreedSizes& agreed, std::vector<ArmFit> fits);

/// The prior of the other arms, if it was also computed from these rows, or many of them: they
/// would count twice. An arm that is only measured again is a further one.
/// @return  an error if too few arms remain
Result<FleetPrior> WithoutArmOf(const MeasuredTable& rows, FleetPrior prior);

/// The effects at their mean, with the spread of a further arm as covariance.
std::vector<effects::ActiveEffect> MeanEffectsOf(const std::vector<SizePrior>& prior,
                                                 const model::CellModel& cell);

/// The prior updated by the rows of an arm: precision-weighted mean of the pooled sizes and a least
/// squares fit of all of them. Sizes that the rows do not determine keep their prior.
struct Posterior {
  /// With the covariance within each effect; that between sizes of different effects is lost.
  std::vector<effects::ActiveEffect> effects;
  std::vector<TipDisplacement> displacements;  ///< of `effects`
  double parameters = 0;                       ///< effective number of fitted ones
  double p_value = 1;                          ///< ProbabilityOf the fit
};
Result<Posterior> UpdatedBy(const Arm& arm, const std::vector<SizePrior>& prior, int threads);

}  // namespace plumbline::measure
