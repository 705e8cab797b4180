// Preparation of a data set from a table of measured rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/data/indices.h"
#include "app/measure/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

// Detection of impossible values: error codes of instruments, temperatures in kelvin, rows out of
// time order.

/// Finds values that their column cannot contain:
///  - codes for "nothing measured" (-9999, 999999, 32767, a point at exactly 0, 0, 0): numbers of
///  such a form whose distance from all other values of the column exceeds the range of those;
///  - temperatures in kelvin: values above 200 in all rows or in some, usually from one line on;
///  - rows out of time order: t_s decreases in at least one step out of twenty. Restarts of a clock
///  are rarer, and in shuffled rows every other step decreases.
/// @return  a sentence with the lines and a remedy; nullopt if all values are possible
std::optional<std::string> ImpossibleValues(const MeasuredTable& table,
                                            const std::vector<model::Joint>& joints);

/// Marks t_s as not recorded, with a note, if its clock was restarted: the times between the
/// restarts are unknown.
void DiscardRestartedClock(MeasuredTable& table);

// Clusters of replicates: rows that measure the same point repeatedly.

struct Clusters {
  PerRow<ClusterIndex> of_row;  ///< numbered from 0 in the order of the rows
  int count = 0;
};

/// Groups rows of one session with the same joints and payload by single linkage: neighbours within
/// a tolerance (0.2 mrad or mm, 10 g) belong together, so that no grid edge divides replicates. A
/// chain wider than ten times the tolerance is a slow motion, not one pose, and is divided into
/// grid cells. O(n log n) unless many rows are at one pose.
Clusters ClustersOf(const std::vector<MeasuredRow>& rows, const PerRow<SessionIndex>& session_of);

/// Checks the rows and prepares the data set.
/// @return  an error with advice if the rows cannot be used at all
Result<Dataset> DatasetFrom(const model::CellModel& cell, MeasuredTable measured);

}  // namespace plumbline::measure
