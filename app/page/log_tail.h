// The newest lines of daemon and viewer, more of them than one state carries.
#pragma once

#include <map>
#include <mutex>
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

/// Gathers lines as states bring them, through restarts of the daemon. For several threads.
class LogTail {
 public:
  static constexpr std::size_t kMost = 300;

  void Take(const ShownNow& now);
  std::vector<TailLine> Lines() const;  ///< oldest first

 private:
  /// A line is known by its second, its number within its program's run, and its program.
  using Key = std::pair<double, std::pair<std::uint64_t, bool>>;
  mutable std::mutex mutex_;
  std::map<Key, TailLine> lines_;
};

}  // namespace plumbline
