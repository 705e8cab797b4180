// Columns whose unit changes from one row to the next: the first rows in degrees, the others in
// radians.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/diagnosis/mistakes.h"

namespace plumbline::diagnosis {

/// Changes of a unit that a column's own numbers show: of a payload (pounds, grams) where the rows
/// on one side, converted, repeat the payloads of the other side; of a turning joint (radians)
/// where no angle on one side exceeds a turn in radians and the other side's do by far. Each is
/// subtle (Mistake::subtle): a light payload, or a joint along whose axis the tool lies, moves the
/// tip by less than effects do.
std::vector<Mistake> UnitChanges(const Dataset& data);

/// Names grams in a part of the payloads where they are more than any robot carries, so that the
/// reader left their rows out (MeasuredTable::excessive_payloads).
std::optional<std::string> PayloadsInGrams(const table::MeasuredTable& table);

/// Names the column whose unit changes where that is what puts measured points far from the
/// predicted ones: some rows lie 25 mm away and farther (kGross_m) as read; with the column
/// converted from one line on, or up to it, the middle one of the converted rows falls below a
/// fifth, and no more than one row in ten stays gross. The line is that of least loss
/// sum_k min(r_k, 25 mm), r_k as read on one side and converted on the other. Of several columns
/// the one with the least loss is named.
/// @return  a sentence with column, line, evidence and what to do
std::optional<std::string> ChangedUnit(const Dataset& data, int threads);

}  // namespace plumbline::diagnosis
