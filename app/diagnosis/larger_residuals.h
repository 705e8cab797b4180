// Search for a condition, or a stretch of rows, in which residuals are larger than elsewhere.
#pragma once

#include <optional>

#include "app/diagnosis/dataset.h"
#include "app/diagnosis/row_condition.h"

namespace plumbline::diagnosis {

/// Poses in which residuals are larger.
struct LargerResiduals {
  int poses = 0;     ///< of these
  int of_poses = 0;  ///< of all
  double ratio = 0;  ///< median residual of these over that of the other poses
  /// First and last of these rows in the order of the file.
  RowIndex first{0}, last{0};
};

/// A condition on a recorded signal under which residuals are larger.
struct LargerUnderCondition : LargerResiduals {
  RowCondition condition;
  int stretches = 0;  ///< of successive poses; with few, a disturbance at that time looks alike
};

/// The condition on a recorded signal under which residuals are larger, if chance does not explain
/// it: rank sum test [F. Wilcoxon, Biometrics Bulletin 1 (1945) 80] of the poses beyond a limit
/// against the others, with its normal approximation. The probability of the best limit, times the
/// limits tried in that column and the number of columns, is at most kConditionSignificance, and
/// the median residual there is at least 1.5 times that of the others. Joints, time and row numbers
/// are not considered.
/// @param sizes  of the residuals in units of the noise; a pose has the mean of its visits
std::optional<LargerUnderCondition> LargerUnderSomeCondition(const Dataset& data,
                                                             const PerRow<double>& sizes);

/// The stretch of successive poses, at most half of them, in which residuals are larger, by the
/// same test over all stretches. nullopt if there is none, or if the order of the rows is unknown.
std::optional<LargerResiduals> LargerInSomeStretch(const Dataset& data,
                                                   const PerRow<double>& sizes);

}  // namespace plumbline::diagnosis
