// The computer under the daemon: clock, disk, programs.
#pragma once

#include "app/config/daemon_config.h"
#include "app/doctor/account.h"
#include "app/doctor/check_up.h"

namespace plumbline {

/// Whether a time service keeps the clock, and the year is one of this program's life.
CheckedThing LookAtClock();
/// @param minimum_bytes  that the journal, lenses and reports of a year need, with room
CheckedThing LookAtState(const std::string& directory, const Account& account);
/// Whether the system's journal outlives a restart.
CheckedThing LookAtJournal(const std::string& persistent = "/var/log/journal");
/// Programs that are started: plumbline-mesh, gnuplot.
CheckUp LookAtPrograms(const DaemonConfig& config, const std::string& beside);

}  // namespace plumbline
