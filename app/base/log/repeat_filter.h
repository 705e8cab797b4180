// Rate limiter for repeated log entries: a loose cable must not fill a disk.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/log/log_entry.h"

namespace plumbline::log {

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

}  // namespace plumbline::log
