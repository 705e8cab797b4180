// Columns of a discrepancy model and their grouping by prior variance.
#pragma once

#include <vector>

#include "app/measure/diagnosis/candidates.h"
#include "app/measure/diagnosis/discrepancy.h"

namespace plumbline::measure {

/// Columns to fit: those of blocks, then curve terms, each assigned to a group.
struct DiscrepancyDesign {
  DiscrepancyModel of;
  std::vector<int> group;
  int groups = 0;
};

/// Every catalogue column that is not exempt, a curve of each joint, and curves along each recorded
/// signal.
DiscrepancyDesign MakeDiscrepancyDesign(const CandidateSet& candidate_set, const Explanation& named,
                                        const Candidates& candidates);

/// Whitened columns of the design at the rows of the problem, not yet projected.
Eigen::MatrixXd ColumnsOf(const LinearProblem& problem, const DiscrepancyDesign& design);

/// Indices of the design columns that belong to named effects.
std::vector<int> NamedColumns(const CandidateSet& candidate_set, const Explanation& named,
                              const DiscrepancyDesign& design);

/// True for an empirical curve of a joint along its own angle.
bool IsJointCurve(const Block& block);

/// Value of the signal of a curve term at a row.
double SignalAt(const Dataset& data, const CurveTerm& term, RowIndex row);

}  // namespace plumbline::measure
