#include "app/base/log/log.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <mutex>
#include <string_view>

#include "app/base/log/log_writer.h"
#include "app/base/log/repeat_filter.h"
#include "app/base/text/visible.h"
#include "drivers/clock.h"

namespace plumbline::log {
namespace {

constexpr const char* kJournalSocket = "/run/systemd/journal/socket";
constexpr double kMinReportedBlockage_s = 1;

/// Whether standard error is journald's stream: JOURNAL_STREAM names its device and inode
/// [systemd.exec(5)].
bool StderrIsJournal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat error {};
  return stream != nullptr && fstat(STDERR_FILENO, &error) == 0 &&
         fmt::format("{}:{}", error.st_dev, error.st_ino) == stream;
}

struct LogState {
  std::mutex mutex;
  LogContext context;
  RepeatFilter repeats;
  std::deque<LogLine> lines;
  std::uint64_t number = 0;
  LogWriter writer{StderrIsJournal() ? kJournalSocket : "", STDERR_FILENO};
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

/// The line as written to a terminal or a file, including the line end.
std::string PlainLine(LogLevel level, const std::string& text) {
  if (isatty(STDERR_FILENO) == 0) return fmt::format("<{}>{}\n", static_cast<int>(level), text);
  const timespec now = UtcNow();
  std::tm local{};
  localtime_r(&now.tv_sec, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03} {}\n", local.tm_hour, local.tm_min, local.tm_sec,
                     now.tv_nsec / 1000000, text);
}

/// The text as one line: a quoted line end would let a name forge a second entry, of any level.
std::string OneLine(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n') + 1;
  std::string line;
  for (const char c : std::string_view(text).substr(0, end)) {
    if (c == '\n') {
      line += "\\u000a";
    } else {
      line += c;
    }
  }
  return line;
}

/// Every line passes here. Texts and values come from files and devices, and must not control the
/// reader's terminal. The caller holds the state's mutex, so that lines stay in order.
void Put(LogState& state, LogEntry entry) {
  entry.text = OneLine(text::Visible(entry.text));
  for (LogField& field : entry.fields) field.value = text::Visible(field.value);
  const timespec now = UtcNow();
  const LogLevel level = EntryOf(entry.event).level;
  state.lines.push_back({++state.number,
                         static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec),
                         level, entry.text});
  if (state.lines.size() > kRecentLogLines) state.lines.pop_front();
  const char* const program = program_invocation_short_name;
  state.writer.Put(
      {JournalDatagram(JournalFields(entry, state.context, program)), PlainLine(level, entry.text)},
      MonotonicSeconds());
}

/// Logs that lines were lost, or were written later than they happened. The caller holds the mutex.
void ReportBlockage(LogState& state) {
  const std::optional<LogWriter::Blockage> blockage = state.writer.TakeBlockage();
  if (!blockage || (blockage->lost == 0 && blockage->duration_s < kMinReportedBlockage_s)) return;
  Put(state,
      {Event::kLogHeldUp,
       fmt::format("log output was blocked for {:.1f} s: the {} lines above are late, {} earlier "
                   "lines were lost",
                   blockage->duration_s, blockage->late, blockage->lost),
       {{"LOST", fmt::format("{}", blockage->lost)}}});
}

}  // namespace

void Log(const LogEntry& entry) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  if (state.repeats.Admit(entry, MonotonicSeconds())) Put(state, entry);
  ReportBlockage(state);
}

void FlushLog(bool all) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  for (const LogEntry& entry : state.repeats.TakeSummaries(MonotonicSeconds(), all))
    Put(state, entry);
  state.writer.Flush(MonotonicSeconds());
  ReportBlockage(state);
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

}  // namespace plumbline::log
