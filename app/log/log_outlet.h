// The log's way out of the process, which never makes anybody wait.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "drivers/os/descriptor.h"

namespace plumbline {

/// Lines go to journald's socket, or to a descriptor, in their order. A journald that hangs, a pipe
/// that nobody reads or a stopped terminal takes nothing: then lines wait here, kMostWaiting of
/// them, and go when they can. Beyond that the oldest are lost, and counted. Not for several
/// threads at once. Times are of any even clock.
class LogOutlet {
 public:
  static constexpr std::size_t kMostWaiting = 256;

  struct Line {
    std::string datagram;  ///< for journald; empty: only `plain`
    std::string plain;     ///< for the descriptor, with its line end
  };
  /// @param journal_socket  journald's; a line that it refuses goes to the descriptor
  LogOutlet(std::string journal_socket, int descriptor);
  /// What still waits gets a fifth of a second.
  ~LogOutlet();
  LogOutlet(const LogOutlet&) = delete;
  LogOutlet& operator=(const LogOutlet&) = delete;

  void Put(Line line, double now_s);
  /// Lets go what can go now.
  void Flush(double now_s);

  /// How it was, once nothing waits any more.
  struct HeldUp {
    double for_s = 0;
    std::uint64_t late = 0, lost = 0;  ///< lines
  };
  /// Told once; nothing while lines wait, or where none had to.
  std::optional<HeldUp> TakeHeldUp();

 private:
  enum class Went { kYes, kNotNow };
  Went Give(const Line& line);
  Went GiveToJournal(const std::string& datagram, bool& refused) const;
  Went GivePlain(const std::string& text);

  std::string journal_socket_;
  Descriptor own_;  ///< of a terminal or a pipe, opened so that it never waits
  int descriptor_;  ///< written to: `own_`, or the one that was given
  Descriptor journal_;
  std::deque<Line> waiting_;
  std::size_t begun_ = 0;  ///< bytes of the first that are written already
  std::optional<double> held_since_s_;
  HeldUp held_up_;
};

}  // namespace plumbline
