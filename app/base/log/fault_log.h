// Conversion of configuration faults to log entries.
#pragma once

#include "app/base/config/fault.h"
#include "app/base/log/log_entry.h"

namespace plumbline::log {

/// One entry for a fault. Its subject is the place in the file, so that the repeat filter never
/// suppresses one fault because of another.
LogEntry LogEntryFromFault(const config::Fault& fault);

void LogFault(const config::Fault& fault);
void LogFaults(const config::FaultList& faults);

}  // namespace plumbline::log
