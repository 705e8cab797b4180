// Whether a running daemon can apply a model.
#pragma once

#include <optional>
#include <string>

#include "app/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Why the daemon must not use this model; nothing where it can. An effect that needs the order of
/// moves (approach_lag, backlash by move) is known of a table's rows, not of a point that the robot
/// has yet to go to: to leave it out would correct wrongly. Likewise an effect of
/// time where the model does not say when its time began, and one that follows a row's number or a
/// column of a file.
std::optional<std::string> WhyNotUsable(const CellModel& cell);

/// What is wrong with the model that the store of a state directory has in force in place of the
/// cell file. Reads only; nothing is wrong with a store that is not there or may not be looked at.
void AddFaultsOfAppliedModel(const std::string& state_directory, FaultList& faults);

/// The same, and that model where nothing is wrong with it.
std::optional<CellModel> AppliedModel(const std::string& state_directory, FaultList& faults);

}  // namespace plumbline
