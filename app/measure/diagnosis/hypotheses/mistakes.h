// Known mistakes in measured data or cell files, each with the change that corrects it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"

namespace plumbline::measure {

/// A hypothesis: a possible mistake, its remedy, and how to correct the data for it.
struct Mistake {
  std::string sentence;  ///< completes "it falls to 0.1 mm if .."
  std::string remedy;
  std::function<void(Dataset&)> undo;
  /// Frames that the alignment then fits in addition to those that the cell leaves free.
  bool fits_tip = false, fits_base = false;
  /// The mistake may move the tip less than effects do; it is tried on all data whose noise is
  /// known.
  bool subtle = false;
  /// True for the rows that the mistake affects; empty if it affects all rows.
  std::function<bool(const MeasuredRow&)> affects = {};
  bool needs_all_rows = false;  ///< values move from row to row, so the rows must not be thinned
  /// For a wrong scale: neighbouring scales. If one of them fits as well, the mistake is not
  /// confirmed.
  std::vector<std::function<void(Dataset&)>> alternatives = {};

  bool fits() const { return fits_tip || fits_base; }
};

/// A coupling of two joints that the cell does not declare, to be added to those that it declares.
Mistake CouplingMistake(const Dataset& data, const model::JointCoupling& coupling);

/// The pairs of revolute joints that may be coupled, with ratio 0.
std::vector<model::JointCoupling> PossibleCouplings(const Dataset& data);

/// All mistakes that are possible for these data; see docs/measure.md, "Mistakes in cell and data".
std::vector<Mistake> MistakesOf(const Dataset& data);

}  // namespace plumbline::measure
