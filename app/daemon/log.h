// The daemon's log: one line a transition, on standard error.
#pragma once

#include <string_view>

namespace plumbline {

/// Priorities of syslog(3), which journald understands as a "<n>" prefix.
enum class LogLevel { kError = 3, kWarning = 4, kNotice = 5, kInfo = 6 };

/// Writes one line. On a terminal with the time of day, otherwise with the prefix that journald
/// turns into a priority. Any thread.
void Log(LogLevel level, std::string_view text);

}  // namespace plumbline
