// Detection of columns whose unit changes within the table, for example from degrees to radians.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/diagnosis/mistakes.h"

namespace plumbline::diagnosis {

/// Unit changes that are visible in a column's numbers alone: of the payload (pounds, grams), if
/// the rows on one side of the change, converted, repeat the payloads of the other side; of a
/// revolute joint (radians), if no angle on one side exceeds a turn in radians and those of the
/// other side do by far. Each is subtle (Mistake::subtle): a light payload, or a joint whose axis
/// passes through the tool, moves the tip by less than effects do.
std::vector<Mistake> UnitChanges(const Dataset& data);

/// Detects that some payloads are in grams, as read larger than any robot carries. The reader has
/// excluded their rows (MeasuredTable::excessive_payloads).
/// @return  a sentence with the evidence and a remedy
std::optional<std::string> PayloadsInGrams(const table::MeasuredTable& table);

/// Detects a unit change that explains gross errors: as read, some measured points are at least 25
/// mm (kGross_m) from the predicted ones; with the column converted from one line on, or up to it,
/// the median distance of the converted rows falls below a fifth, and at most one row in ten
/// remains gross. The line minimises the loss sum_k min(r_k, 25 mm) of the distances r_k, as read
/// on one side and converted on the other. If several columns qualify, the one with the smallest
/// loss is reported.
/// @return  a sentence with column, line, evidence and remedy
std::optional<std::string> ChangedUnit(const Dataset& data, int threads);

}  // namespace plumbline::diagnosis
