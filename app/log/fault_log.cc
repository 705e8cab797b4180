#include "app/log/fault_log.h"

#include <fmt/format.h>

#include "app/log/log.h"

namespace plumbline {

LogEntry LogEntryFromFault(const Fault& fault) {
  const bool is_fault = fault.severity == Fault::Severity::kFault;
  return {is_fault ? Event::kFileFault : Event::kFileWarning,
          FaultText(fault),
          {{"PLACE", fmt::format("{}:{} {}", fault.file, fault.line, fault.key)},
           {"CONFIG_FILE", fault.file},
           {"CONFIG_LINE", fmt::format("{}", fault.line)},
           {"CONFIG_KEY", fault.key}}};
}

void LogFault(const Fault& fault) {
  Log(LogEntryFromFault(fault));
}

void LogFaults(const FaultList& faults) {
  for (const Fault& fault : faults.All()) LogFault(fault);
}

}  // namespace plumbline
