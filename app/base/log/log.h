// The process-wide log: one line for each event, to journald with fields or to standard error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/base/log/log_entry.h"

namespace plumbline::log {

/// Logs an entry. If standard error is connected to journald, the entry goes there with all its
/// fields; a terminal gets the time of day, anything else the "<n>" prefix that journald turns into
/// a priority. Repeats are counted (RepeatFilter). May be called from any thread. Never blocks: a
/// line that cannot be written now is buffered (LogWriter).
void Log(const LogEntry& entry);

/// Logs the summaries of repeats that are due and writes buffered lines. To be called about once a
/// second, from any thread. @param all  before exit: also summaries that are not due yet
void FlushLog(bool all = false);

/// Sets the context that every further entry carries.
void SetLogContext(LogContext context);

struct LogLine {
  std::uint64_t number = 0;  ///< counts up from 1 since the start
  double utc_s = 0;
  LogLevel level = LogLevel::kNotice;
  std::string text;
};

/// The newest lines, oldest first, at most kRecentLogLines. May be called from any thread.
inline constexpr std::size_t kRecentLogLines = 40;
std::vector<LogLine> RecentLog();

}  // namespace plumbline::log
