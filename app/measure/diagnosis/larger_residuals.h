// Search for a condition, or a stretch of rows, in which residuals are larger than elsewhere.
#pragma once

#include <optional>

#include "app/measure/diagnosis/dataset.h"
#include "app/measure/diagnosis/row_condition.h"

namespace plumbline::measure {

/// Poses in which residuals are larger.
struct LargerResiduals {
  int poses = 0;     ///< of these
  int of_poses = 0;  ///< of all
  double ratio = 0;  ///< median residual of these over that of the other poses
  /// First and last of these rows in the order of the file.
  RowIndex first{0}, last{0};
  double p_value = 1;  ///< of chance, over everything that was tried
};

/// Stretches in which a condition must hold before a disturbance at that time is excluded.
inline constexpr int kMinStretches = 3;

/// A condition on a recorded signal under which residuals are larger.
struct LargerUnderCondition : LargerResiduals {
  RowCondition condition;
  int stretches = 0;  ///< of successive rows under the condition
};

/// The condition on a recorded signal under which residuals are larger, if chance does not explain
/// it: rank sum test [F. Wilcoxon, Biometrics Bulletin 1 (1945) 80] of the poses beyond a limit
/// against the others, with its normal approximation. The probability of the best limit of a
/// column, times the limits tried there and the number of columns, is at most
/// kConditionSignificance, and the median residual there is at least 1.5 times that of the others.
/// Of several such columns, one whose condition came and went kMinStretches times is preferred.
/// Joints, time and row numbers are not considered.
/// @param sizes  of the residuals, comparable between rows of different kinds; a pose has the mean
///               of its visits, and the mean of the signal
std::optional<LargerUnderCondition> FindLargerUnderCondition(const Dataset& data,
                                                             const PerRow<double>& sizes);

/// The stretch of successive poses, at most half of them, in which residuals are larger, by the
/// same test over all stretches. Successive visits of a pose count once. nullopt if there is none,
/// or if the order of the rows is unknown.
std::optional<LargerResiduals> FindLargerForAWhile(const Dataset& data,
                                                   const PerRow<double>& sizes);

}  // namespace plumbline::measure
