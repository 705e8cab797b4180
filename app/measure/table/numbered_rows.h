// Check of the tool and payload item numbers in a table against what the cell declares.
#pragma once

#include <optional>
#include <string>

#include "app/measure/table/csv.h"

namespace plumbline::measure {

/// Checks the columns `tool` and `payload_item` against what the cell declares.
/// @return  the first problem with place, value and remedy ("line 7: tool 3 is not declared ...");
///          nullopt if every row names a declared tool and item, or needs none
std::optional<std::string> NumberProblem(const model::CellModel& cell, const MeasuredTable& table);

/// Notes on columns that are recorded but not used, and on items that no row can switch on.
std::vector<std::string> NumberNotes(const model::CellModel& cell, const MeasuredTable& table);

}  // namespace plumbline::measure
