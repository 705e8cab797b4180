// The log: one line an event, to the journal with fields, else to standard error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/log/log_entry.h"

namespace plumbline {

/// Tells it. Where standard error is journald's, with all its fields; on a terminal with the time
/// of day; elsewhere with the "<n>" that journald turns into a priority. Repeats are counted
/// (Repeats). Any thread. Never waits: what cannot be written now is kept for a while (LogOutlet).
void Log(const LogEntry& entry);

/// Tells what was counted and is due, and what could not be written before; at the end, all of it.
/// Called every second or so. Any thread.
void LogRepeats(bool all = false);

/// What every entry is about from now on.
void SetLogContext(LogContext context);

struct LogLine {
  std::uint64_t number = 0;  ///< counts up from 1 since the start
  double utc_s = 0;
  LogLevel level = LogLevel::kNotice;
  std::string text;
};

/// The newest lines, oldest first, at most kKeptLogLines. Any thread.
inline constexpr std::size_t kKeptLogLines = 40;
std::vector<LogLine> RecentLog();

}  // namespace plumbline
