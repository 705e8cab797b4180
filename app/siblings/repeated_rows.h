// Rows that two sets of measurements have in common.
#pragma once

#include <cstddef>

#include "app/table/csv.h"

namespace plumbline::siblings {

/// Number of rows of `b` that are also rows of `a`: joints and readings that are equal after
/// rounding to 1e-6 rad and 1e-6 m, equal artefact. Each row of `a` counts once. Time, temperature,
/// payload and order may differ, since they are easily edited.
std::size_t RepeatedRows(const table::MeasuredTable& a, const table::MeasuredTable& b);

/// True if so many rows cannot be equal by chance: more than a tenth of the smaller set, and at
/// least three. Two arms moved to the same commanded joints differ by more than the resolution of a
/// measured position in practically every row; the reading of a coarse gauge (0.01 mm, arms that
/// differ by 0.1 mm) agrees by chance in three of a hundred.
bool IsRepeated(std::size_t repeated, std::size_t rows_a, std::size_t rows_b);

}  // namespace plumbline::siblings
