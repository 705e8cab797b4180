// Discrepancy model: a shrunken fit of the residual that the named effects leave. It corrects
// within the measured range and explains nothing.
#pragma once

#include <optional>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/search.h"
#include "app/measure/diagnosis/shrinkage.h"

namespace plumbline::measure {

/// One column of a curve: an entry of the influence times sin or cos(cycles q) of its joint, or
/// times a Legendre polynomial of a signal.
struct CurveTerm {
  int entry = 0;       ///< carrier: entry of the influence
  SignalIndex signal;  ///< argument of the curve
  int degree = 0;      ///< of the polynomial; 0: periodic
  double cycles = 0;
  bool cosine = false;
  double value = 0;  ///< SI
};

/// Fitted sizes of all catalogue blocks and curves, except named blocks that are exempt
/// (`IsExemptFromShrinkage`).
struct DiscrepancyModel {
  Indexed<BlockIndex, Block> blocks;  ///< catalogue blocks, linear in their sizes
  Coefficients sizes;                 ///< total sizes, including those of named effects
  std::vector<CurveTerm> curves;
  Eigen::MatrixXd covariance;                                         ///< of sizes, then curves
  std::vector<std::pair<BlockIndex, BlockColumnIndex>> size_columns;  ///< of each size
  double effective_parameters = 0;
  double gain = 0;  ///< in 2 ln(marginal likelihood) over the named effects alone
};

/// True for a named block that is exempt from shrinkage: it has shapes, or follows a signal. A
/// curve of a joint along its own angle is not exempt; the one of the discrepancy model replaces
/// it.
bool IsExemptFromShrinkage(const Block& block);

/// Fits all catalogue columns, a curve of each joint and curves along each recorded signal at once,
/// each group shrunk by marginal likelihood, frames projected out. nullopt unless its gain over the
/// named effects alone exceeds kDiscrepancyMargin after a cost of ln(1 + columns) per group.
std::optional<DiscrepancyModel> DiscrepancyModelOf(const CandidateSet& candidate_set,
                                                   const Explanation& named,
                                                   const Candidates& candidates);

/// Factor of a curve term on its carrier at a value of its signal.
double FactorAt(const Dataset& data, const CurveTerm& term, double value);

/// Name of the column of a joint angle: q3_deg.
/// @param joint  0-based
std::string AngleColumn(int joint);

/// Change of a row's prediction caused by all sizes and curves, including those of named effects.
RowResidual DisplacementBy(const DiscrepancyModel& discrepancy, const Dataset& data,
                           const Linearisation& linear, RowIndex row);

/// The effects to add to a model with the named effects so that their sum is the fitted discrepancy
/// model. Curves become `empirical` effects whose factor carries the standard deviation.
std::vector<Finding> EffectsToAdd(const DiscrepancyModel& discrepancy, const Dataset& data,
                                  const Model& named);

}  // namespace plumbline::measure
