#include "app/daemon/log.h"

#include <fmt/format.h>
#include <unistd.h>

#include <ctime>
#include <deque>
#include <mutex>

namespace plumbline {
namespace {

struct KeptLines {
  std::mutex mutex;
  std::deque<LogLine> lines;
  std::uint64_t number = 0;
};

KeptLines& Kept() {
  static KeptLines kept;
  return kept;
}

void Keep(LogLevel level, std::string_view text) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  KeptLines& kept = Kept();
  const std::lock_guard lock(kept.mutex);
  kept.lines.push_back({++kept.number,
                        static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec),
                        level, std::string(text)});
  if (kept.lines.size() > kKeptLogLines) kept.lines.pop_front();
}

}  // namespace

std::vector<LogLine> RecentLog() {
  KeptLines& kept = Kept();
  const std::lock_guard lock(kept.mutex);
  return {kept.lines.begin(), kept.lines.end()};
}

void Log(LogLevel level, std::string_view text) {
  Keep(level, text);
  fmt::memory_buffer line;
  if (isatty(STDERR_FILENO) != 0) {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    std::tm local{};
    localtime_r(&now.tv_sec, &local);
    fmt::format_to(std::back_inserter(line), "{:02}:{:02}:{:02}.{:03} ", local.tm_hour,
                   local.tm_min, local.tm_sec, now.tv_nsec / 1000000);
  } else {
    fmt::format_to(std::back_inserter(line), "<{}>", static_cast<int>(level));
  }
  line.append(text);
  line.push_back('\n');
  // One write a line, so that threads do not mix theirs; nothing can be done where it fails.
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), line.size());
}

}  // namespace plumbline
