#include "app/base/log/fault_log.h"

#include <fmt/format.h>

#include "app/base/log/log.h"

namespace plumbline::log {
namespace {

/// A damaged file may have a fault in every line.
constexpr std::size_t kMaxLogged = 100;

}  // namespace

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
  std::size_t logged = 0;
  for (const config::Fault& fault : faults.All()) {
    if (++logged > kMaxLogged) break;
    LogFault(fault);
  }
  if (faults.All().size() <= kMaxLogged) return;
  Log({faults.HasFaults() ? Event::kFileFault : Event::kFileWarning,
       fmt::format("{} more faults and warnings are not logged; `plumbline check` prints them all",
                   faults.All().size() - kMaxLogged)});
}

}  // namespace plumbline::log
