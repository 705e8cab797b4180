// Limits on what one cell may send, so that a faulty or hostile one costs the others nothing.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace plumbline::plant {

/// Admits the messages of a cell at a rate on its own time axis, so that a backlog of hours, which
/// arrives at once, passes; and as many a day of arrival.
class Admission {
 public:
  /// What a change of all points of a cell may send in one instant.
  static constexpr double kBurst = 5000;

  Admission(int per_second, int per_day) : per_second_(per_second), per_day_(per_day) {}

  /// @param cell    number of the cell
  /// @param utc_ms  time in the message; that of arrival if it has none
  /// @param now_s   UTC of arrival [s]
  /// @return        nullptr, or why the message is refused
  const char* Refused(int cell, std::int64_t utc_ms, double now_s);

 private:
  struct Account {
    double tokens = kBurst;
    std::int64_t newest_ms = 0;
    std::int64_t day = 0;
    std::int64_t today = 0;
  };
  const double per_second_;
  const std::int64_t per_day_;
  std::map<int, Account> accounts_;
};

}  // namespace plumbline::plant
