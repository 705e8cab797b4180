// Faults of files as entries of the log.
#pragma once

#include "app/config/fault.h"
#include "app/log/log_entry.h"

namespace plumbline {

/// One line; each place of a file is a subject of its own, so that none is counted away.
LogEntry EntryOfFault(const Fault& fault);

void LogFault(const Fault& fault);
void LogFaults(const FaultList& faults);

}  // namespace plumbline
