// Detection of impossible values: error codes of instruments, temperatures in kelvin, rows out of
// time order.
#pragma once

#include <optional>
#include <string>

#include "app/measure/table/csv.h"

namespace plumbline::measure {

/// Finds values that their column cannot contain:
///  - codes for "nothing measured" (-9999, 999999, 32767, a point at exactly 0, 0, 0): numbers of
///  such a form whose distance from all other values of the column exceeds the range of those;
///  - temperatures in kelvin: values above 200 in all rows or in some, usually from one line on;
///  - rows out of time order: t_s decreases in at least one step out of twenty. Restarts of a clock
///  are rarer, and in shuffled rows every other step decreases.
/// @return  a sentence with the lines and a remedy; nullopt if all values are possible
std::optional<std::string> ImpossibleValues(const MeasuredTable& table,
                                            const std::vector<model::Joint>& joints);

/// Marks t_s as not recorded, with a note, if its clock was restarted: the times between the
/// restarts are unknown.
void DiscardRestartedClock(MeasuredTable& table);

}  // namespace plumbline::measure
