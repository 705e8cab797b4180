// Values that no cell has: an instrument's codes for "none", kelvin, a clock that runs backwards.
#pragma once

#include <optional>
#include <string>

#include "app/table/csv.h"

namespace plumbline::diagnosis {

/// Finds values that cannot be what their column says:
///  - codes for "nothing measured" (-9999, 999999, 32767, a point at exactly 0, 0, 0): numbers of
///    that form that lie farther beyond all other values of the column than those spread;
///  - temperatures in kelvin: all above 200, or those of some rows, from a line on as a rule;
///  - rows that are not in the order of their clock: t_s falls in one step of twenty or more, where
///    restarts of a clock are rare and shuffled rows fall in every other step.
/// @return  a sentence that names the lines and says what to do; nothing where all is possible
std::optional<std::string> ImpossibleValues(const table::MeasuredTable& table,
                                            const std::vector<model::Joint>& joints);

/// A clock that was restarted now and then says nothing about the time between those starts: t_s is
/// given up, with a note.
void GiveUpRestartedClock(table::MeasuredTable& table);

}  // namespace plumbline::diagnosis
