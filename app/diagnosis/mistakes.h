// Mistakes that somebody makes in data or cell, each with the change that takes it back.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/diagnosis/dataset.h"

namespace plumbline::diagnosis {

/// A hypothesis: what may be wrong, what to do about it, and the data as if it were right.
struct Mistake {
  std::string sentence;  ///< after "it falls to 0.1 mm if .."
  std::string remedy;
  std::function<void(Dataset&)> undo;
  /// Numbers that the alignment fits then beside those that the cell leaves free: the tip, the
  /// base.
  bool fits_tip = false, fits_base = false;
  /// It may be smaller than what effects do: asked of every set whose noise is known.
  bool subtle = false;
  /// The rows whose numbers it changes; empty: every row.
  std::function<bool(const table::MeasuredRow&)> concerns = {};
  bool of_neighbours = false;  ///< it moves values from row to row: all rows are needed
  /// Changes that are nearly the same and must not do as well, where the hypothesis is a size.
  std::vector<std::function<void(Dataset&)>> beside = {};

  bool fits() const { return fits_tip || fits_base; }
};

/// All that can be asked of these data; see MANUAL.md, "Mistakes".
std::vector<Mistake> MistakesOf(const Dataset& data);

}  // namespace plumbline::diagnosis
