// The recorded table that transport = "replay" plays.
#pragma once

#include <optional>

#include "app/config/daemon_config.h"
#include "app/table/csv.h"

namespace plumbline {

/// Reads config.robot.replay_file for the joints of config.cell.
/// @param faults  gets faults of the header, a fault where no row can be played, and a warning for
///                each row that is left out
/// @return        the table; nothing where it has a fault
std::optional<MeasuredTable> ReadReplayFile(const DaemonConfig& config, FaultList& faults);

}  // namespace plumbline
