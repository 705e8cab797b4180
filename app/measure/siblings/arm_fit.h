// Values of given effects in one arm, fitted to its measured rows.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/findings.h"

namespace plumbline::measure {

struct Estimate {
  double value = 0;
  double sd = 0;  ///< of the measurement alone, > 0
};

/// Distribution of a number over the arms of a model: normal with this mean and spread.
struct Pooled {
  double mean = 0;
  double between_sd = 0;  ///< from arm to arm, upper limit
  double mean_sd = 0;     ///< of `mean`
  int arms = 0;

  /// Standard deviation of the value of a further arm about `mean`.
  double next_sd() const;
};

/// value_i = mean + b_i + e_i with the spread of b unknown. Few arms may be alike by chance, so
/// that `between_sd` is the upper 80 % confidence limit of the spread, by the Q-profile method: the
/// value at which the weighted squares about the mean equal the 20 % quantile of chi-square with
/// arms - 1 degrees of freedom [Viechtbauer 2007, doi:10.1002/sim.2514]. It is at least
/// kLeastSpread of the mean.
/// @param common  spread as a share of the mean that the quantity shares with others
///                (CommonSpread); it replaces the limit
/// @return        nullopt with fewer than two estimates
std::optional<Pooled> PoolEstimates(std::span<const Estimate> estimates,
                                    std::optional<double> common = std::nullopt);

/// Spread of several quantities from arm to arm, as a share of their means.
struct CommonSpread {
  double spread = 0;            ///< at least kLeastCommonSpread
  std::vector<bool> shared_by;  ///< per quantity
};

/// The upper 80 % confidence limit of the common spread, by the Q-profile method over all
/// quantities that share it. With few arms, many quantities together determine the spread far
/// better than each one alone. It is not shared by quantities whose mean is within three of its
/// standard deviations of zero, nor by those that contradict the spread of the others (1 %, over
/// all quantities).
/// @return  nullopt if fewer than kMinCommonFreedom degrees of freedom remain
std::optional<CommonSpread> CommonSpreadOf(std::span<const std::vector<Estimate>> quantities);

/// Standard deviation of quantities with mean zero that is the same for all, its upper 80 %
/// confidence limit as above; 0 if the estimates are within their own errors.
double SpreadAboutZero(std::span<const Estimate> estimates);

/// Judgement: arms of one model differ at least by this share, if few estimates show their spread.
inline constexpr double kLeastSpread = 0.1;
inline constexpr double kLeastCommonSpread = 0.02;  ///< likewise, if many do
inline constexpr double kMinCommonFreedom = 8;

/// One parameter of an effect with the role kSize, as it occurs in every arm of a model.
struct SizeKey {
  const effects::Effect* effect = nullptr;
  std::string_view word;  ///< of the effect; empty: the first choice
  effects::TermParameter parameter;
  bool operator==(const SizeKey&) const = default;
};

/// The sizes of an effect that other arms may share: of effects of the arm itself
/// (EffectTraits::of_arm) without shapes (a phase, the time of an event). Empty for all others.
std::vector<SizeKey> SharedSizes(const effects::EffectTerm& term);

/// Effects with the sizes given, grouped by effect and word.
std::vector<effects::ActiveEffect> EffectsWith(const std::vector<SizeKey>& keys,
                                               const std::vector<double>& values,
                                               std::uint32_t prismatic);

/// What an arm's own diagnosis found, as far as a fit of sizes needs it.
struct ArmFindings {
  std::vector<effects::ActiveEffect> effects;
  std::map<int, double> weight_of_line;  ///< of the robust fit; a missing line has weight 0
  double sigma_m = 0;
};
ArmFindings FindingsOf(const Diagnosis& diagnosis);

/// The rows of one arm with what its own diagnosis found.
struct Arm {
  std::string name;
  model::CellModel cell;
  MeasuredTable rows;
  ArmFindings found;
};

/// A joint fit of sizes.
struct SizeFit {
  std::vector<SizeKey> keys;  ///< those that the rows determine
  Eigen::VectorXd values;     ///< of `keys`, SI
  Eigen::MatrixXd covariance;
};

/// Whether the other findings of an arm take part in a fit of sizes. They must not if `start` is to
/// be corrected by rows that were not used to select anything.
enum class OwnFindings { kFitted, kOmitted };

/// Least squares fit of the sizes; rows that the arm's own diagnosis rejected have no weight. The
/// covariance is scaled by the scatter of the residuals if that exceeds the noise. Sizes that the
/// rows do not determine are missing from the result.
/// @param start  value of each key at the start, SI
Result<SizeFit> FitSizes(const Arm& arm, const std::vector<SizeKey>& keys,
                         const std::vector<double>& start, OwnFindings own, int threads);

/// RMS of the rows against the cell with its frames aligned; rows that the diagnosis rejected are
/// excluded [m].
Result<double> AlignedRms(const model::CellModel& cell, const Arm& arm, int threads);

/// Displacement of the measured point by each effect, over the same rows.
Result<std::vector<TipDisplacement>> DisplacementsBy(
    const std::vector<effects::ActiveEffect>& effects, const Arm& arm, int threads);

/// `= 0.002`, or `< 1e-12` where only the size of the number is known.
std::string ProbabilityText(double probability);

}  // namespace plumbline::measure
