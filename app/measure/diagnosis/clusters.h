// Clusters of replicates: rows that measure the same point repeatedly.
#pragma once

#include <vector>

#include "app/measure/diagnosis/indices.h"
#include "app/measure/table/csv.h"

namespace plumbline::measure {

struct Clusters {
  PerRow<ClusterIndex> of_row;  ///< numbered from 0 in the order of the rows
  int count = 0;
};

/// Groups rows of one session with the same joints and payload by single linkage: neighbours within
/// a tolerance (0.2 mrad or mm, 10 g) belong together, so that no grid edge divides replicates. A
/// chain wider than ten times the tolerance is a slow motion, not one pose, and is divided into
/// grid cells. O(n log n) unless many rows are at one pose.
Clusters ClustersOf(const std::vector<MeasuredRow>& rows, const PerRow<SessionIndex>& session_of);

}  // namespace plumbline::measure
