// Rows that share a condition, or a stretch of time, and that the model fits worse than the others:
// an effect that acts there is then more likely than gross errors.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"

namespace plumbline::measure {

/// Whether a row is one of those of a condition on a recorded signal, a tool or a payload item;
/// false for the other conditions.
bool Meets(const RowCondition& condition, const Dataset& data, RowIndex row);

/// A condition, and how many of its rows were rejected.
struct OutlierCondition {
  RowCondition condition;
  int rows = 0, rejected = 0;
};

/// A quantity at every row that no column records.
struct RowQuantity {
  std::string column;
  PerRow<double> values;
};

/// What gravity does at every row: the torque about each revolute joint ("tau2_Nm"), its size
/// ("|tau2_Nm|": a gear that gives way does so in both directions) and the moment
/// about the horizontal axes of W at the base ("base_moment_x_Nm"), from the gradients
///   d p / d compliance = tau d p / d turn,   d p / d pedestal = M_x d p / d tilt_x + M_y d p / d
///   tilt_y
/// @param linear  with gradients
std::vector<RowQuantity> GravityLoadsAt(const Dataset& data, const Linearisation& linear);

/// The signal of a quantity: "tau2_Nm" of its size "|tau2_Nm|".
std::string DriverOf(std::string quantity);

/// The condition under which rows were rejected, if chance does not explain it: of m rejected rows
/// among n, at least x are among the k rows beyond a limit, k < 4 x, with the hypergeometric
/// probability P(X >= x). That of the best limit, times the number of limits tried, must be at most
/// 0.001. Considered are all recorded signals, joints, time and row number included, and `more`. An
/// instrument may fail in one region or for a while: a run of rejected rows, at most two accepted
/// ones between them, therefore counts as one row, and repeated visits of a pose count once, since
/// one badly seated pose is one error. Rows on one artefact or from one camera are such a
/// condition, too, as it may have moved; runs of rows count in full there, with P(X = m) that all
/// rejected rows are on it. So are rows of one tool, payload item, session or kind of observation
/// (column "kind") if also at least half of those rows are rejected. nullopt if there are fewer
/// than three rejected rows by this count.
std::optional<OutlierCondition> ConditionOfOutliers(const Dataset& data,
                                                    const PerRow<double>& weights,
                                                    const std::vector<RowQuantity>& more = {});

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

/// Rows under a condition that were rejected, or whose residuals are larger: what acts there is
/// unknown. Loads of gravity are considered up to the number of rows that are searched.
Opinion OpinionOnMisfit(const Identified& identified, const FitOfAllRows& fit);

}  // namespace plumbline::measure
