// Whether a running daemon can apply a model.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Why the daemon must not use this model; nothing where it can. An effect that needs the order of
/// moves (approach_lag, backlash by move) is known of a table's rows, not of a point that the robot
/// has yet to go to: to leave it out would correct wrongly. Likewise an effect of
/// time where the model does not say when its time began, and one that follows a row's number or a
/// column of a file.
std::optional<std::string> WhyNotUsable(const CellModel& cell);

}  // namespace plumbline
