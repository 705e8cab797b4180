// Repair of measured tables: detection of lost lines, and filling of empty cells.
#pragma once

#include <cstddef>
#include <vector>

#include "app/base/config/fault.h"
#include "app/measure/table/csv.h"

namespace plumbline::measure {

/// Finds where lines were lost, and adds those places to `table.breaks` and to its notes:
///  - an additional column of integers that increases by one in at least half of the steps is a row
///    counter: rows are missing where it increases by more. It is not a signal, and is removed;
///  - if the robust standard deviation of the intervals of t_s (1.4826 times the median absolute
///    deviation) is less than 0.15 of their median, at least one row was lost in an interval longer
///    than 1.6 medians (the median plus four such deviations).
/// Without a row counter and with an irregular clock, lost lines remain undetected.
/// @param rows  all rows with joint values, measured or not, in file order
void FindLostLines(std::vector<MeasuredRow>& rows, MeasuredTable& table);

/// Fills empty cells (NaN), discarding as few measurements as possible:
///  - t_s, temp_C, additional signals: interpolated between the neighbouring rows of the session,
///    over t_s or else over the row index, and constant before the first and after the last. A
///    column that is empty in more than half of the rows is dropped instead, as not recorded;
///  - payload_kg: that of the neighbours if they agree; otherwise the payload is unknown, and the
///    row counts as unmeasured;
///  - qd, qdd: the row's vector becomes empty (not recorded in that row);
///  - tau: the row counts as unmeasured, because the joints deflect under their torque;
///  - q_step: the largest of the column.
/// Each repair is reported once for each column, as a warning and in the notes.
void FillEmptyCells(std::vector<MeasuredRow>& rows, MeasuredTable& table,
                    config::FaultList& faults);

/// Makes a row count as unmeasured.
void DiscardMeasurement(MeasuredRow& row);

/// Removes an additional column from the rows and the table.
void DropFurther(std::size_t column, std::vector<MeasuredRow>& rows, MeasuredTable& table);

}  // namespace plumbline::measure
