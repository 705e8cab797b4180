// Non-blocking output of log lines to journald or a file descriptor.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "drivers/os/descriptor.h"

namespace plumbline::log {

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

}  // namespace plumbline::log
