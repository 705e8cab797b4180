// The process-wide log: one line for each event, to journald with fields or to standard error.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/config/fault.h"
#include "app/base/log/log_entry.h"
#include "drivers/os/descriptor.h"

namespace plumbline::log {

// Conversion of configuration faults to log entries.

/// One entry for a fault. Its subject is the place in the file, so that the repeat filter never
/// suppresses one fault because of another.
LogEntry LogEntryFromFault(const config::Fault& fault);

void LogFault(const config::Fault& fault);
void LogFaults(const config::FaultList& faults);

// Non-blocking output of log lines to journald or a file descriptor.

/// Writes lines in order to journald's socket, or to a descriptor. While the receiver accepts
/// nothing (a journald that hangs, a pipe that nobody reads, a stopped terminal), up to
/// kMaxBuffered lines are buffered and written as soon as possible; beyond that the oldest are
/// dropped and counted. Not thread-safe. Times are from any monotonic clock.
class LogWriter {
 public:
  static constexpr std::size_t kMaxBuffered = 256;

  struct Line {
    std::string datagram;  ///< for journald; empty: only `plain`
    std::string plain;     ///< for the descriptor, including the line end
  };
  /// @param journal_socket  path of journald's socket; lines that it refuses go to `descriptor`
  LogWriter(std::string journal_socket, int descriptor);
  /// Tries for 0.2 s to write what is still buffered.
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  void Put(Line line, double now_s);
  /// Writes as many buffered lines as the receiver accepts now.
  void Flush(double now_s);

  /// A period in which the receiver accepted nothing.
  struct Blockage {
    double duration_s = 0;
    std::uint64_t late = 0, lost = 0;  ///< lines
  };
  /// The most recent blockage, returned once after it ends; nullopt while lines are buffered, or if
  /// there was none.
  std::optional<Blockage> TakeBlockage();

 private:
  enum class WriteResult { kDone, kWouldBlock };
  WriteResult Write(const Line& line);
  WriteResult WriteToJournal(const std::string& datagram, bool& refused) const;
  WriteResult WritePlain(const std::string& text);

  std::string journal_socket_;
  os::Descriptor reopened_;  ///< the terminal or pipe, opened again as non-blocking
  int descriptor_;           ///< written to: `reopened_`, or the one passed to the constructor
  os::Descriptor journal_;
  std::deque<Line> buffered_;
  std::size_t written_bytes_ = 0;  ///< of the first buffered line
  std::optional<double> blocked_since_s_;
  Blockage blockage_;
};

// Rate limiter for repeated log entries: a loose cable must not fill a disk.

/// Passes at most `kMaxPerMinute` entries a minute for one event and subject. Further ones are
/// counted and summarized in one entry when the minute is over; the summary repeats the text of
/// the latest, so that the current state always reaches the log. Answers to a person's action, such
/// as the press of a gauge's button, have a higher limit. Pure: times are an input, from any
/// monotonic clock.
class RepeatFilter {
 public:
  static constexpr int kMaxPerMinute = 5, kMaxAnswersPerMinute = 60;
  static constexpr std::size_t kMaxSubjects = 256;  ///< further subjects share one count

  /// @return  whether the entry is to be logged now; otherwise it has been counted
  bool Admit(const LogEntry& entry, double now_s);
  /// Summaries that are due. @param all  also those whose minute is not over
  std::vector<LogEntry> TakeSummaries(double now_s, bool all = false);

 private:
  struct Count {
    double since_s = 0;
    int logged = 0, suppressed = 0;
    LogEntry latest;
  };
  std::map<std::pair<Event, std::string>, Count> counts_;
};

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
