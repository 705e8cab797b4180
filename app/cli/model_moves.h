// By how much another model moves the points of the daemon's configuration, for a person to read.
#pragma once

#include <string>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline {

/// The corrected commands of the configured points by two models, at the configured loads. Where no
/// configuration is known, how far the unloaded tip moves, and that this says less.
/// @param config_file  as given by the user; empty: the one that the daemon of the state directory
///                     has noted there
/// @return why the file that was given cannot be used
Result<std::string> MovesText(const std::string& state_directory, const std::string& config_file,
                              const CellModel& in_force, const CellModel& next);

}  // namespace plumbline
