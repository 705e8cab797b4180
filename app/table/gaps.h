// Empty cells and lost lines of a measured table.
#pragma once

#include <cstddef>
#include <vector>

#include "app/config/fault.h"
#include "app/table/csv.h"

namespace plumbline {

/// Finds where lines were lost, and adds those places to `table.breaks` and to its notes:
///  - a further column of whole numbers that rises by one in at least half of the steps counts the
///    rows: where it rises by more, rows are missing. It is no signal, and is taken out;
///  - a clock whose intervals scatter by less than 0.15 of their median (1.4826 times the median
///    absolute deviation): an interval beyond 1.6 medians, four of those deviations, lacks a row.
/// Neither is noticed where no column counts and the clock is irregular.
/// @param rows  all that have joints, measured or not, in file order
void FindLostLines(std::vector<MeasuredRow>& rows, MeasuredTable& table);

/// Fills cells that are NaN, each at the price of that cell alone where it can be:
///  - t_s, temp_C, further signals: interpolated between the neighbours of the session (over t_s,
///    else over the rows); constant beyond the first and the last. A column that fewer than half of
///    the rows hold is given up instead: not recorded;
///  - payload_kg: that of the neighbours where they agree; else nobody knows what hung there, and
///    the row is taken as unmeasured;
///  - qd, qdd: the row's vector becomes empty (not recorded in that row);
///  - tau: the row is taken as unmeasured, because its own joints bend by it;
///  - q_step: the largest of the column.
/// What was done is said once a column, as a warning and in the notes.
void FillEmptyCells(std::vector<MeasuredRow>& rows, MeasuredTable& table, FaultList& faults);

/// Takes a further column out of the rows and the table.
void DropFurther(std::size_t column, std::vector<MeasuredRow>& rows, MeasuredTable& table);

}  // namespace plumbline
