// Checks of the computer: clock, state directory, system journal, programs.
#pragma once

#include "app/base/config/daemon_config.h"
#include "app/cli/doctor/account.h"
#include "app/cli/doctor/check_result.h"

namespace plumbline::cli {

/// Whether the clock is synchronised and was ever set.
CheckResult CheckClock();
/// Whether the state directory exists, is writable for `account` and has free space.
CheckResult CheckStateDirectory(const std::string& directory, const Account& account);
/// Whether every row of the measurement journal is as it was written; nothing if there is none.
CheckResults CheckJournal(const std::string& state_directory);
/// Whether the systemd journal is persistent.
CheckResult CheckSystemJournal(const std::string& persistent = "/var/log/journal");
/// Whether the programs needed at run time are installed: plumbline-mesh, gnuplot.
/// @param program_directory  directory of Plumbline's own programs
CheckResults CheckPrograms(const config::DaemonConfig& config,
                           const std::string& program_directory);

}  // namespace plumbline::cli
