// Collected log of daemon and viewer, longer than the excerpt that one state contains.
#pragma once

#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/display/view/display_mailbox.h"

namespace plumbline::display {

struct RecentLogEntry {
  double utc_s = 0;
  int level = 5;     ///< syslog(3) level
  const char* from;  ///< "plumblined" or "plumbline-view"
  std::string text;
};

/// Collects the lines of successive states in order of arrival, across restarts of the daemon and
/// when the clock is set back. Thread-safe.
class LogTail {
 public:
  static constexpr std::size_t kMaxLines = 300;

  void Add(const display::DisplayStatus& now);
  std::vector<RecentLogEntry> Lines() const;  ///< oldest first

 private:
  /// Identity of a line: its time, its number in the program's run, and the program.
  using Key = std::pair<double, std::pair<std::uint64_t, bool>>;
  mutable std::mutex mutex_;
  std::deque<std::pair<Key, RecentLogEntry>> lines_;
  std::set<Key> known_;  ///< keys of lines_ and of the last state's lines
};

}  // namespace plumbline::display
