// When a device that failed is tried again.
#pragma once

#include <algorithm>

namespace plumbline {

/// After 0.1 s, 0.2 s, .. 1 s: what comes back is found soon, however long it was away.
class BackOff {
 public:
  static constexpr double kFirst_s = 0.1, kLongest_s = 1;

  bool Due(double now_s) const { return now_s >= next_s_; }
  void Failed(double now_s) {
    next_s_ = now_s + wait_s_;
    wait_s_ = std::min(2 * wait_s_, kLongest_s);
  }
  void Well() { wait_s_ = kFirst_s; }

 private:
  double wait_s_ = kFirst_s;
  double next_s_ = -1e300;
};

}  // namespace plumbline
