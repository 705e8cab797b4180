// Limits on what one cell may send, so that a faulty or hostile one costs the others nothing.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace plumbline::plant {

/// Admits the messages of a cell at a rate on its own time axis, so that a backlog of hours, which
/// arrives at once, passes; and as many a day of arrival. Messages without a time, such as births,
/// have an account of their own on the time of arrival.
class Admission {
 public:
  /// What a change of all points of a cell may send in one instant.
  static constexpr double kBurst = 5000;
  static constexpr double kBurstWithoutTime = 100, kPerSecondWithoutTime = 1;

  Admission(int per_second, int per_day) : per_second_(per_second), per_day_(per_day) {}

  /// @param cell    number of the cell; 0: it cannot be told
  /// @param utc_ms  time in the message
  /// @param now_s   UTC of arrival [s]
  /// @param cost    in messages
  /// @return        nullptr, or why the message is refused
  const char* Refused(int cell, std::optional<std::int64_t> utc_ms, double now_s, double cost = 1);

 private:
  /// Refilled by the time that passes, up to its size.
  struct Bucket {
    double tokens;
    std::int64_t newest_ms = 0;
    bool Take(std::int64_t at_ms, double per_second, double most, double cost);
  };
  struct Account {
    Bucket timed{kBurst}, untimed{kBurstWithoutTime};
    std::int64_t day = 0, today = 0;
  };
  double per_second_;
  std::int64_t per_day_;
  std::map<int, Account> accounts_;
};

}  // namespace plumbline::plant
