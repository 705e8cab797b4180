#include "app/log/log.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <mutex>

#include "app/log/log_outlet.h"
#include "app/log/repeats.h"
#include "drivers/clock.h"

namespace plumbline {
namespace {

constexpr const char* kJournalSocket = "/run/systemd/journal/socket";
constexpr double kWorthTelling_s = 1;

/// Whether standard error goes to journald, which says so by device and inode (systemd.exec(5)).
bool ErrorIsJournal() {
  const char* told = std::getenv("JOURNAL_STREAM");
  struct stat error {};
  return told != nullptr && fstat(STDERR_FILENO, &error) == 0 &&
         fmt::format("{}:{}", error.st_dev, error.st_ino) == told;
}

struct LogState {
  std::mutex mutex;
  LogContext context;
  Repeats repeats;
  std::deque<LogLine> lines;
  std::uint64_t number = 0;
  LogOutlet outlet{ErrorIsJournal() ? kJournalSocket : "", STDERR_FILENO};
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

/// As it stands on a terminal or in a file, with its line end.
std::string PlainLine(LogLevel level, const std::string& text) {
  if (isatty(STDERR_FILENO) == 0) return fmt::format("<{}>{}\n", static_cast<int>(level), text);
  const timespec now = UtcNow();
  std::tm local{};
  localtime_r(&now.tv_sec, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03} {}\n", local.tm_hour, local.tm_min, local.tm_sec,
                     now.tv_nsec / 1000000, text);
}

/// The state's mutex is held, so that lines keep their order.
void Put(LogState& state, const LogEntry& entry) {
  const timespec now = UtcNow();
  const LogLevel level = EntryOf(entry.event).level;
  state.lines.push_back({++state.number,
                         static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec),
                         level, entry.text});
  if (state.lines.size() > kKeptLogLines) state.lines.pop_front();
  const char* const program = program_invocation_short_name;
  state.outlet.Put(
      {JournalDatagram(JournalFields(entry, state.context, program)), PlainLine(level, entry.text)},
      MonotonicSeconds());
}

/// That lines were lost, or stand at a later time than they belong to. The mutex is held.
void TellHeldUp(LogState& state) {
  const std::optional<LogOutlet::HeldUp> held = state.outlet.TakeHeldUp();
  if (!held || (held->lost == 0 && held->for_s < kWorthTelling_s)) return;
  Put(state,
      {Event::kLogHeldUp,
       fmt::format("the log was held up for {:.1f} s: the {} lines above are late, {} before "
                   "them are lost",
                   held->for_s, held->late, held->lost),
       {{"LOST", fmt::format("{}", held->lost)}}});
}

}  // namespace

void Log(const LogEntry& entry) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  if (state.repeats.Pass(entry, MonotonicSeconds())) Put(state, entry);
  TellHeldUp(state);
}

void LogRepeats(bool all) {
  LogState& state = State();
  const std::lock_guard lock(state.mutex);
  for (const LogEntry& entry : state.repeats.Due(MonotonicSeconds(), all)) Put(state, entry);
  state.outlet.Flush(MonotonicSeconds());
  TellHeldUp(state);
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
