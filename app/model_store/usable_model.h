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

/// Appends, of what was found in a model of the store, the warning that it was changed after it was
/// fitted. Its other warnings are of declared values and are reported with the cell file.
/// @param model_file  to be named in it
void AppendChangedModelWarning(const FaultList& of_model, const std::string& model_file,
                               FaultList& faults);

/// What is wrong with the store of a state directory: its state cannot be read, the model that is
/// in force in place of the cell file cannot be used; and, as warnings, that an applied model is
/// set aside, or would be at the next start or reload, or was changed after it was fitted. Reads
/// only; nothing is wrong with a store that is not there or that this user may not look into.
/// @param cell_file  that the configuration names; empty: not compared
/// @return           the model that is in force in place of the cell file, where nothing is wrong
///                   with it
std::optional<CellModel> AddFaultsOfModelStore(const std::string& state_directory,
                                               const std::string& cell_file, FaultList& faults);

}  // namespace plumbline
