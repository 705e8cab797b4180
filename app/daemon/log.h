// The daemon's log: one line a transition, on standard error.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// Priorities of syslog(3), which journald understands as a "<n>" prefix.
enum class LogLevel { kError = 3, kWarning = 4, kNotice = 5, kInfo = 6 };

/// Writes one line. On a terminal with the time of day, otherwise with the prefix that journald
/// turns into a priority. Any thread.
void Log(LogLevel level, std::string_view text);

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
