// Checks whether the daemon can use a model.
#pragma once

#include <optional>
#include <string>

#include "app/base/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cell {

/// Why the daemon must not use this model; nullopt if it can. Effects that depend on the order of
/// moves (approach_lag, backlash by move) can be evaluated for the rows of a table, but not for a
/// point that the robot has yet to reach, and leaving them out would give wrong corrections. The
/// same holds for time-dependent effects if the model does not define its time zero, and for
/// effects that depend on a row number or a file column.
std::optional<std::string> ModelUnusableReason(const model::CellModel& cell);

/// From the faults found in a stored model, appends only the warning that the model was changed
/// after its fit. The other warnings concern declared values and are reported with the cell file.
/// @param of_model    the faults of the stored model
/// @param model_file  path to be shown in the warning
void AppendChangedModelWarning(const config::FaultList& of_model, const std::string& model_file,
                               config::FaultList& faults);

/// Checks the model store of a state directory. Faults: its state cannot be read, or the model in
/// force in place of the cell file cannot be used. Warnings: an applied model is set aside, would
/// be at the next start or reload, or was changed after its fit. Read-only; a store that is missing
/// or that this user may not read has no faults.
/// @param cell_file  the configured cell file; not compared if empty
/// @return           the model in force in place of the cell file, if it has no faults
std::optional<model::CellModel> CheckModelStore(const std::string& state_directory,
                                                const std::string& cell_file,
                                                config::FaultList& faults);

}  // namespace plumbline::cell
