// Rows of a table -> what the effects of a cell read at each of them.
#pragma once

#include "app/table/csv.h"
#include "firmware-like/effects/influence.h"

namespace plumbline {

/// The conditions of every row. Moves are those of the file's order within a session, rows without
/// a measurement among them. The move before the first row of a session is not known, nor one over
/// a break of the table, nor the approach of a joint until it moved after either: `last_move` is
/// empty there.
std::vector<Conditions> ConditionsOf(const CellModel& cell, const MeasuredTable& table);

}  // namespace plumbline
