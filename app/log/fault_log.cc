#include "app/log/fault_log.h"

#include <fmt/format.h>

#include "app/log/log.h"

namespace plumbline::log {

LogEntry LogEntryFromFault(const config::Fault& fault) {
  const bool is_fault = fault.severity == config::Fault::Severity::kFault;
  return {is_fault ? Event::kFileFault : Event::kFileWarning,
          config::FaultText(fault),
          {{"PLACE", fmt::format("{}:{} {}", fault.file, fault.line, fault.key)},
           {"CONFIG_FILE", fault.file},
           {"CONFIG_LINE", fmt::format("{}", fault.line)},
           {"CONFIG_KEY", fault.key}}};
}

void LogFault(const config::Fault& fault) {
  Log(LogEntryFromFault(fault));
}

void LogFaults(const config::FaultList& faults) {
  for (const config::Fault& fault : faults.All()) LogFault(fault);
}

}  // namespace plumbline::log
