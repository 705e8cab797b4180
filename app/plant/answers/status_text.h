// The plant's state as text of 80 columns and as JSON.
#pragma once

#include <string>

#include "app/plant/answers/plant_status.h"

namespace plumbline::plant {

/// A table of the cells, most urgent first, and what is missing, unreadable or refused.
std::string StatusText(const PlantState& plant);

/// Names and types are stable within "schema" 1: later versions add names.
/// What was not read is not in it.
std::string StatusJson(const PlantState& plant);

/// Whether something in the plant needs a person: exit code 1 of the command.
bool NeedsPerson(const PlantState& plant);

}  // namespace plumbline::plant
