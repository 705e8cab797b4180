// Checks of plumbline.toml that involve several of its tables, the cell or the robot profile.
#pragma once

#include "app/base/config/daemon_config.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {

/// Adds faults and warnings to `root` for tables that are valid by themselves but contradict each
/// other: a port or serial line used twice, a robot profile that reads too little for the payload
/// or the cell, a robot input that would always be stale.
/// @param cell_known  false if the cell has faults of its own, so that `config.machine.cell` is
///                    empty
void CheckAcrossTables(const TomlTable& root, const DaemonConfig& config, bool cell_known);

}  // namespace plumbline::config
