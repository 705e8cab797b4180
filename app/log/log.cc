#include "app/log/log.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <mutex>

#include "app/log/repeats.h"
#include "drivers/clock.h"

namespace plumbline {
namespace {

struct LogState {
  std::mutex mutex;
  LogContext context;
  Repeats repeats;
  std::deque<LogLine> lines;
  std::uint64_t number = 0;
};

LogState& State() {
  static LogState state;
  return state;
}

timespec UtcNow() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now;
}

/// Whether standard error goes to journald, which says so by device and inode (systemd.exec(5)).
bool ErrorIsJournal() {
  const char* told = std::getenv("JOURNAL_STREAM");
  struct stat error {};
  return told != nullptr && fstat(STDERR_FILENO, &error) == 0 &&
         fmt::format("{}:{}", error.st_dev, error.st_ino) == told;
}

bool ToJournal(const std::vector<std::string>& fields) {
  std::vector<iovec> parts;
  for (const std::string& field : fields) {
    parts.push_back({const_cast<char*>(field.data()), field.size()});
  }
  return sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) == 0;
}

void ToStandardError(LogLevel level, const std::string& text) {
  fmt::memory_buffer line;
  if (isatty(STDERR_FILENO) != 0) {
    const timespec now = UtcNow();
    std::tm local{};
    localtime_r(&now.tv_sec, &local);
    fmt::format_to(std::back_inserter(line), "{:02}:{:02}:{:02}.{:03} ", local.tm_hour,
                   local.tm_min, local.tm_sec, now.tv_nsec / 1000000);
  } else {
    fmt::format_to(std::back_inserter(line), "<{}>", static_cast<int>(level));
  }
  fmt::format_to(std::back_inserter(line), "{}\n", text);
  // One write a line, so that threads do not mix theirs; nothing can be done where it fails.
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), line.size());
}

/// The state's mutex is held, so that lines keep their order.
void Put(LogState& state, const LogEntry& entry) {
  const timespec now = UtcNow();
  const LogLevel level = EntryOf(entry.event).level;
  state.lines.push_back({++state.number,
                         static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec),
                         level, entry.text});
  if (state.lines.size() > kKeptLogLines) state.lines.pop_front();
  static const bool journal = ErrorIsJournal();
  const char* const program = program_invocation_short_name;
  if (!journal || !ToJournal(JournalFields(entry, state.context, program))) {
    ToStandardError(level, entry.text);
  }
}

}  // namespace

void Log(const LogEntry& entry) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  if (state.repeats.Pass(entry, MonotonicSeconds())) Put(state, entry);
}

void LogRepeats(bool all) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  for (const LogEntry& entry : state.repeats.Due(MonotonicSeconds(), all)) Put(state, entry);
}

void SetLogContext(LogContext context) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  state.context = std::move(context);
}

std::vector<LogLine> RecentLog() {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  return {state.lines.begin(), state.lines.end()};
}

}  // namespace plumbline
