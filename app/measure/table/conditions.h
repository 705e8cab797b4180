// Conditions under which the effects are evaluated, for each row of a table.
#pragma once

#include "app/measure/table/csv.h"
#include "firmware-like/effects/influence.h"

namespace plumbline::measure {

/// The conditions of every row. Moves follow the file order within a session, including rows
/// without a measurement. The move to the first row of a session and a move across a break of the
/// table are unknown: `last_move` is empty there. So is the approach direction of a joint until it
/// has moved after that.
std::vector<effects::Conditions> ConditionsOf(const model::CellModel& cell,
                                              const MeasuredTable& table);

}  // namespace plumbline::measure
