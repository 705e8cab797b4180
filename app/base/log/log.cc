#include "app/base/log/log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <mutex>
#include <string_view>

#include "app/base/text/text.h"
#include "drivers/clock.h"

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

namespace {

constexpr int kFinalTries = 20, kTryPeriod_ms = 10;

/// Opens a terminal or pipe again as non-blocking: a write to it may block even if poll() reports
/// it as writable. O_NONBLOCK on the given descriptor itself would affect every process that shares
/// it. Returns -1 if the descriptor is neither.
int ReopenNonBlocking(int descriptor) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0 || (!S_ISFIFO(file.st_mode) && isatty(descriptor) == 0)) {
    return -1;
  }
  const std::string path = "/proc/self/fd/" + std::to_string(descriptor);
  return open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

LogWriter::LogWriter(std::string journal_socket, int descriptor)
    : journal_socket_(std::move(journal_socket)),
      reopened_(ReopenNonBlocking(descriptor)),
      descriptor_(reopened_ ? reopened_.get() : descriptor),
      journal_(journal_socket_.empty() ? -1 : socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

LogWriter::~LogWriter() {
  for (int tries = 0; !buffered_.empty() && tries < kFinalTries; ++tries) {
    Flush(0);
    if (!buffered_.empty()) poll(nullptr, 0, kTryPeriod_ms);
  }
}

void LogWriter::Put(Line line, double now_s) {
  buffered_.push_back(std::move(line));
  Flush(now_s);
  if (buffered_.empty()) return;
  ++blockage_.late;
  if (buffered_.size() <= kMaxBuffered) return;
  // Drop the oldest line; a partly written one must be completed.
  buffered_.erase(buffered_.begin() + (written_bytes_ > 0 ? 1 : 0));
  --blockage_.late;
  ++blockage_.lost;
}

void LogWriter::Flush(double now_s) {
  while (!buffered_.empty()) {
    if (Write(buffered_.front()) == WriteResult::kWouldBlock) {
      if (!blocked_since_s_) blocked_since_s_ = now_s;
      return;
    }
    buffered_.pop_front();
    written_bytes_ = 0;
  }
  if (blocked_since_s_) blockage_.duration_s = now_s - *blocked_since_s_;
}

std::optional<LogWriter::Blockage> LogWriter::TakeBlockage() {
  if (!buffered_.empty() || !blocked_since_s_) return std::nullopt;
  blocked_since_s_.reset();
  return std::exchange(blockage_, {});
}

LogWriter::WriteResult LogWriter::Write(const Line& line) {
  if (journal_ && !line.datagram.empty() && written_bytes_ == 0) {
    bool refused = false;
    const WriteResult result = WriteToJournal(line.datagram, refused);
    if (!refused) return result;
  }
  return WritePlain(line.plain);
}

LogWriter::WriteResult LogWriter::WriteToJournal(const std::string& datagram, bool& refused) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  journal_socket_.copy(address.sun_path, sizeof address.sun_path - 1);
  for (;;) {
    if (sendto(journal_.get(), datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), sizeof address) >= 0) {
      return WriteResult::kDone;
    }
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == ENOBUFS) return WriteResult::kWouldBlock;
    refused = true;  // no journald, or the line is too long for it
    return WriteResult::kDone;
  }
}

LogWriter::WriteResult LogWriter::WritePlain(const std::string& text) {
  while (written_bytes_ < text.size()) {
    pollfd writable{descriptor_, POLLOUT, 0};
    poll(&writable, 1, 0);
    // Nobody will ever read this: discard the line instead of buffering.
    if ((writable.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return WriteResult::kDone;
    if ((writable.revents & POLLOUT) == 0) return WriteResult::kWouldBlock;
    // A writable pipe accepts PIPE_BUF bytes without blocking [pipe(7)].
    const std::size_t piece = std::min<std::size_t>(text.size() - written_bytes_, PIPE_BUF);
    ssize_t written =
        send(descriptor_, text.data() + written_bytes_, piece, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) {
      written = write(descriptor_, text.data() + written_bytes_, piece);
    }
    if (written > 0) {
      written_bytes_ += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN) {
      return WriteResult::kWouldBlock;
    } else if (errno != EINTR) {
      return WriteResult::kDone;  // unwritable: discard the line
    }
  }
  return WriteResult::kDone;
}

namespace {

constexpr double kMinute_s = 60;

/// The point, client or device that the entry is about; empty if it has no fields.
std::string SubjectOf(const LogEntry& entry) {
  return entry.fields.empty() ? std::string() : entry.fields.front().value;
}

int MostPerMinute(Event event) {
  const bool answer = event == Event::kGaugeRecorded || event == Event::kGaugeRefused;
  return answer ? RepeatFilter::kMaxAnswersPerMinute : RepeatFilter::kMaxPerMinute;
}

LogEntry Summary(const LogEntry& latest, int suppressed) {
  const char* const name = EntryOf(latest.event).name;
  return {
      Event::kRepeated,
      fmt::format("{}: {} more in the last minute, the latest: {}", name, suppressed, latest.text),
      {{"REPEATED_EVENT", name}, {"REPEATED", fmt::format("{}", suppressed)}}};
}

}  // namespace

bool RepeatFilter::Admit(const LogEntry& entry, double now_s) {
  std::pair<Event, std::string> key{entry.event, SubjectOf(entry)};
  if (counts_.size() >= kMaxSubjects && counts_.find(key) == counts_.end()) key.second.clear();
  Count& count = counts_[key];
  if (count.logged == 0) count.since_s = now_s;
  if (count.logged < MostPerMinute(entry.event)) {
    ++count.logged;
    return true;
  }
  ++count.suppressed;
  count.latest = entry;
  return false;
}

std::vector<LogEntry> RepeatFilter::TakeSummaries(double now_s, bool all) {
  std::vector<LogEntry> summaries;
  for (auto it = counts_.begin(); it != counts_.end();) {
    const Count& count = it->second;
    if (!all && now_s - count.since_s < kMinute_s) {
      ++it;
      continue;
    }
    if (count.suppressed > 0) summaries.push_back(Summary(count.latest, count.suppressed));
    it = counts_.erase(it);
  }
  return summaries;
}

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
