// What the named effects leave: every other column of the catalogue, a curve of each joint and
// along each recorded signal, shrunk. It corrects where there is data; it explains nothing.
#pragma once

#include <optional>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"
#include "app/diagnosis/shrinkage.h"

namespace plumbline {

/// One column of a curve: an influence times sin or cos(cycles q) of its joint, or times the
/// Legendre polynomial of a signal.
struct CurveTerm {
  int entry = 0;       ///< influence that carries it
  SignalIndex signal;  ///< that it follows
  int degree = 0;      ///< of a polynomial; 0: periodic
  double cycles = 0;
  bool cosine = false;
  double value = 0;  ///< SI
};

/// Sizes of everything but what stays as it was named (`Stays`).
struct DiscrepancyModel {
  Indexed<BlockIndex, Block> blocks;  ///< of the catalogue, linear in their sizes
  Coefficients sizes;                 ///< whole sizes, those of named effects included
  std::vector<CurveTerm> curves;
  Eigen::MatrixXd covariance;                                         ///< of sizes, then curves
  std::vector<std::pair<BlockIndex, BlockColumnIndex>> size_columns;  ///< of each size
  double held = 0;  ///< parameters that the data hold
  double gain = 0;  ///< of 2 ln(marginal likelihood), beside the named effects
};

/// True of a named block that is not shrunk again: it has shapes of its own, or follows a signal.
/// A curve of a joint along its own angle does not stay: that of the discrepancy model replaces it.
bool Stays(const Block& block);

/// Fits all sizes at once, each kind shrunk by marginal likelihood, frames projected out. Absent
/// where the named effects, left unshrunk, do as well: its gain over them has to exceed
/// ln(1 + columns) for each group with a variance, and a margin.
std::optional<DiscrepancyModel> DiscrepancyModelOf(const Pool& pool, const Explanation& named,
                                                   const Candidates& candidates);

/// What multiplies a curve term's influence where its signal has a value.
double FactorAt(const Dataset& data, const CurveTerm& term, double value);

/// The column that holds a joint's angle: q3_deg.
std::string AngleOf(int joint);

/// What all sizes and curves change of a row's prediction.
RowResidual DisplacementBy(const DiscrepancyModel& discrepancy, const Dataset& data,
                           const Linearisation& linear, RowIndex row);

/// The effects to add to a model that has the named ones, so that the whole is what was fitted.
/// Curves are written as `empirical`, whose factors carry the deviation.
std::vector<Finding> AddedBy(const DiscrepancyModel& discrepancy, const Dataset& data,
                             const Model& named);

}  // namespace plumbline
