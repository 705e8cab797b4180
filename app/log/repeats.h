// Repeats of an event are counted, not repeated: a loose cable must not fill a disk.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/log/log_entry.h"

namespace plumbline {

/// Lets at most `kMostAMinute` entries a minute pass of one event of one subject; the others are
/// counted, and told by one entry when the minute is over, with the words of the latest, so that
/// how things stand is always told. Pure; times are of any even clock.
class Repeats {
 public:
  static constexpr int kMostAMinute = 5;
  static constexpr std::size_t kMostSubjects = 256;  ///< beyond them, all share one count

  /// Whether the entry is to be told.
  bool Pass(const LogEntry& entry, double now_s);
  /// What was counted and is due. With `all` also what is not.
  std::vector<LogEntry> Due(double now_s, bool all = false);

 private:
  struct Count {
    double since_s = 0;
    int told = 0, held = 0;
    LogEntry latest;
  };
  std::map<std::pair<Event, std::string>, Count> counts_;
};

}  // namespace plumbline
