// The newest lines of daemon and viewer, more of them than one state carries.
#pragma once

#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/view/shown.h"

namespace plumbline {

struct TailLine {
  double utc_s = 0;
  int level = 5;     ///< of syslog(3)
  const char* from;  ///< "plumblined" or "plumbline-view"
  std::string text;
};

/// Gathers lines as states bring them, through restarts of the daemon and a clock that is set back:
/// in the order of arrival. For several threads.
class LogTail {
 public:
  static constexpr std::size_t kMost = 300;

  void Take(const ShownNow& now);
  std::vector<TailLine> Lines() const;  ///< first come, first

 private:
  /// A line is known by its second, its number within its program's run, and its program.
  using Key = std::pair<double, std::pair<std::uint64_t, bool>>;
  mutable std::mutex mutex_;
  std::deque<std::pair<Key, TailLine>> lines_;
  std::set<Key> known_;  ///< of lines_, and of what the last state carried
};

}  // namespace plumbline
