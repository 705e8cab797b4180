// Load at the flange from the stated payload, tool number and payload item number.
#pragma once

#include "firmware-like/loads/gravity.h"

namespace plumbline::loads {

/// Index of the tool with a number, see CellModel::ToolAt. A cell whose only tool has no number has
/// index 0 for every number; so has an absent number if there is one tool.
/// @return  nullopt if the cell declares no such tool, or several and `number` is absent
std::optional<int> ToolIndexOf(const model::CellModel& cell, std::optional<int> number);

/// The payload item with a number; null if `number` is absent, 0 or not declared.
const model::PayloadItem* ItemOf(const model::CellModel& cell, std::optional<int> number);

/// Mass of the payload item with a number [kg]; 0 if there is none.
double ItemMass_kg(const model::CellModel& cell, std::optional<int> number);

/// The payload together with an item, as one mass at the common centre of gravity. Exact, because
/// weight enters the model only by mass and first moment.
Payload WithItem(const Payload& payload, const model::PayloadItem* item);

/// Load of a row. A payload mass that is absent, or for which the cell has no [payload] cog_mm,
/// counts as 0 kg; so does an item that is not declared. An undeclared tool counts as the first.
Payload LoadOf(const model::CellModel& cell, std::optional<double> payload_kg,
               std::optional<int> tool_number, std::optional<int> payload_item);

}  // namespace plumbline::loads
