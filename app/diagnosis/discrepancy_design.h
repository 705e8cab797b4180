// The columns of a discrepancy model, and which of them share a prior variance.
#pragma once

#include <vector>

#include "app/diagnosis/candidates.h"
#include "app/diagnosis/discrepancy.h"

namespace plumbline {

/// What is fitted: blocks' columns, then curve terms, with their groups.
struct DiscrepancyDesign {
  DiscrepancyModel of;
  std::vector<int> group;
  int groups = 0;
};

/// Every column of the catalogue, a curve of each joint and along each recorded signal.
DiscrepancyDesign DesignFor(const Pool& pool, const Explanation& named,
                            const Candidates& candidates);

/// Whitened, at the problem's rows; a column for each of the design.
Eigen::MatrixXd ColumnsOf(const LinearProblem& problem, const DiscrepancyDesign& design);

/// Columns of named effects alone, in the groups of the whole.
std::vector<int> NamedColumns(const Pool& pool, const Explanation& named,
                              const DiscrepancyDesign& design);

/// A named curve of a joint along its own angle.
bool IsJointCurve(const Block& block);

/// The value at a row of the signal that a curve term follows.
double SignalAt(const Dataset& data, const CurveTerm& term, RowIndex row);

}  // namespace plumbline
