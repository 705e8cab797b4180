// Search for a condition that most rejected rows share: an effect that acts there is then more
// likely than gross errors.
#pragma once

#include <optional>

#include "app/measure/diagnosis/dataset.h"
#include "app/measure/diagnosis/row_condition.h"

namespace plumbline::measure {

/// A condition, and how many of its rows were rejected.
struct OutlierCondition {
  RowCondition condition;
  int rows = 0, rejected = 0;
};

/// The condition under which rows were rejected, if chance does not explain it: of m rejected rows
/// among n, at least x are among the k rows beyond a limit, k < 4 x, with the hypergeometric
/// probability P(X >= x). That of the best limit, times the number of limits tried, must be at most
/// 0.001. Signals are payload, temperature and further columns; joints and time are not considered,
/// because an instrument may fail in one region or for a while. For the same reason a run of
/// rejected rows, at most two accepted ones between them, counts as one row: a signal that drifts
/// has similar values in all of them. Repeated visits of a pose count once, since one badly seated
/// pose is one error. Rows on one artefact or from one camera are such a condition, too, as it may
/// have moved; runs of rows count in full there, with P(X = m) that all rejected rows are on it. So
/// are rows of one tool, payload item, session or kind of observation (column "kind") if also at
/// least half of those rows are rejected. nullopt if there are fewer than three rejected rows by
/// this count.
std::optional<OutlierCondition> ConditionOfOutliers(const Dataset& data,
                                                    const PerRow<double>& weights);

/// Whether a row is one of those of a condition on a recorded signal, a tool or a payload item;
/// false for the other conditions.
bool Meets(const RowCondition& condition, const Dataset& data, RowIndex row);

}  // namespace plumbline::measure
