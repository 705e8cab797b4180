// Columns that the effects of a cell read and a pose does not have.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// A column that an effect reads and the conditions lack; the effect then adds nothing.
struct MissingColumn {
  std::string column;  ///< "t_s", "temp_C", or that of an empirical term
  std::string effect;  ///< id of the first effect that reads it
  /// Values over which the effects were fitted, in file units; for a time without a fitted span,
  /// from zero to long after any event.
  model::Interval range;
};

/// Speeds and accelerations are not reported: without them, the pose is at rest. Neither is the
/// order of moves.
/// @param cell  has the effects; its domain and reference temperature bound the temperature, which
///              is otherwise taken to lie within 10 K of the reference
std::vector<MissingColumn> MissingColumns(std::span<const ActiveEffect> effects,
                                          const Conditions& conditions,
                                          const model::CellModel& cell);

/// The conditions with a value for such a column.
Conditions WithColumn(Conditions conditions, const std::string& column, double value);

}  // namespace plumbline::effects
