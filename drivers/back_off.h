// Exponential back-off for reconnecting to a failed device.
#pragma once

#include <algorithm>

namespace plumbline {

/// Retries after 0.1 s, 0.2 s, 0.4 s, ... and then every second, so that a device that returns is
/// found within a second, however long it was absent.
class BackOff {
 public:
  static constexpr double kFirst_s = 0.1, kLongest_s = 1;

  /// True if the next attempt is due.
  bool Due(double now_s) const { return now_s >= next_s_; }
  /// @param least_s  shortest wait, if the device should not be tried again so soon
  void Failed(double now_s, double least_s = 0) {
    next_s_ = now_s + std::max(wait_s_, least_s);
    wait_s_ = std::min(2 * wait_s_, kLongest_s);
  }
  void Well() { wait_s_ = kFirst_s; }

 private:
  double wait_s_ = kFirst_s;
  double next_s_ = -1e300;
};

}  // namespace plumbline
