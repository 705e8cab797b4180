// Columns that the effects of a cell read, and the range over which they were fitted.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// A column without which an effect adds nothing.
struct NeededColumn {
  std::string column;  ///< "t_s", "temp_C", or that of an empirical term
  std::string effect;  ///< id of the first effect that reads it
  /// Values over which the effects were fitted, in file units; for a time without a fitted span,
  /// from zero to long after any event.
  model::Interval range;

  /// Does not allocate.
  bool MissingFrom(const Conditions& conditions) const {
    return !conditions.Signal(column).has_value();
  }
};

/// Speeds and accelerations are not listed: without them, the pose is at rest. Neither is the order
/// of moves.
/// @param cell  has the effects; its domain and reference temperature bound the temperature, which
///              is otherwise taken to lie within 10 K of the reference
std::vector<NeededColumn> NeededColumns(std::span<const ActiveEffect> effects,
                                        const model::CellModel& cell);

/// The conditions with a value for a column.
Conditions WithColumn(Conditions conditions, const std::string& column, double value);

}  // namespace plumbline::effects
