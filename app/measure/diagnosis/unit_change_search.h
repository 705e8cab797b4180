// Search for a change of a column's unit that explains gross errors.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Detects a unit change that explains gross errors: as read, some measured points are at least 25
/// mm (kGross_m) from the predicted ones; with the column converted from one line on, or up to it,
/// the median distance of the converted rows falls below a fifth, and at most one row in ten
/// remains gross. The line minimises the loss sum_k min(r_k, 25 mm) of the distances r_k, as read
/// on one side and converted on the other. If several columns qualify, the one with the smallest
/// loss is reported.
/// @return  a sentence with column, line, evidence and remedy
std::optional<std::string> ChangedUnit(const Dataset& data, int threads);

}  // namespace plumbline::measure
