// Table of recorded joint values for transport = "replay".
#pragma once

#include <optional>

#include "app/base/config/daemon_config.h"
#include "app/measure/table/csv.h"

namespace plumbline::measure {

/// Reads config.robot.replay_file for the joints of config.cell.
/// @param faults  receives faults of the header, a fault if no row can be replayed, and a warning
///                for each row that is left out
/// @return        the table; nullopt if it has a fault
std::optional<MeasuredTable> ReadReplayFile(const config::DaemonConfig& config,
                                            config::FaultList& faults);

}  // namespace plumbline::measure
