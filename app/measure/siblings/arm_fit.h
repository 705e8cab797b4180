// Values of given effects in one arm, fitted to its measured rows.
#pragma once

#include <string>
#include <vector>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/siblings/random_effects.h"

namespace plumbline::measure {

/// One parameter of an effect with the role kSize, as it occurs in every arm of a model.
struct SizeKey {
  const effects::Effect* effect = nullptr;
  std::string_view word;  ///< of the effect; empty: the first choice
  effects::TermParameter parameter;
  bool operator==(const SizeKey&) const = default;
};

/// The sizes of a finding that other arms may share: of effects of the arm itself
/// (EffectTraits::of_arm) without shapes (a phase, the time of an event). Empty for all others.
std::vector<SizeKey> SharedSizes(const Finding& finding);

/// Effects with the sizes given, grouped by effect and word.
std::vector<effects::ActiveEffect> EffectsWith(const std::vector<SizeKey>& keys,
                                               const std::vector<double>& values,
                                               std::uint32_t prismatic);

/// The rows of one arm with what its own diagnosis found.
struct Arm {
  std::string name;
  model::CellModel cell;
  MeasuredTable rows;
  Diagnosis diagnosis;
};

/// A joint fit of sizes.
struct SizeFit {
  std::vector<SizeKey> keys;  ///< those that the rows determine
  Eigen::VectorXd values;     ///< of `keys`, SI
  Eigen::MatrixXd covariance;
};

/// Least squares fit of the sizes, together with the other effects that the arm's own diagnosis
/// found; rows that it rejected have no weight. The covariance is scaled by the scatter of the
/// residuals if that exceeds the noise. Sizes that the rows do not determine are missing from the
/// result.
/// @param start  value of each key at the start, SI
/// @param own    whether the other findings of the arm take part; they must not if `start` is to be
///               corrected by rows that were not used to select anything
Result<SizeFit> FitSizes(const Arm& arm, const std::vector<SizeKey>& keys,
                         const std::vector<double>& start, bool own, int threads);

/// RMS of the rows against the cell with its frames aligned; rows that the diagnosis rejected are
/// excluded [m].
Result<double> AlignedRms(const model::CellModel& cell, const Arm& arm, int threads);

}  // namespace plumbline::measure
