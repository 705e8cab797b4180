// Which rows measure the same point again.
#pragma once

#include <vector>

#include "app/diagnosis/indices.h"
#include "app/table/csv.h"

namespace plumbline {

struct Clusters {
  PerRow<ClusterIndex> of_row;  ///< numbered from 0 in the order of the rows
  int count = 0;
};

/// Rows of one session with the same joints and payload measure the same point: neighbours within a
/// tolerance (0.2 mrad or mm, 10 g), chained, so that no edge cuts repeats apart [single linkage].
/// A chain wider than ten times that is no pose any more but a slow path, and is cut into cells.
/// O(n log n) unless many rows stand at one pose.
Clusters ClustersOf(const std::vector<MeasuredRow>& rows, const PerRow<SessionIndex>& session_of);

}  // namespace plumbline
