// Heartbeat of the PLC: a counter that it changes while its program runs.
#pragma once

#include <cstdint>
#include <optional>

namespace plumbline {

/// Optional for the PLC: until the counter has changed once, it is neither alive nor lost.
class PlcHeartbeat {
 public:
  void Observe(std::uint16_t counter, double now_s) {
    if (counter != counter_) {
      counter_ = counter;
      changed_s_ = now_s;
    }
    alive_ = changed_s_ && now_s - *changed_s_ < kTimeout_s;
  }

  bool alive() const { return alive_; }
  bool lost() const { return changed_s_ && !alive_; }

 private:
  static constexpr double kTimeout_s = 2.0;
  std::uint16_t counter_ = 0;
  std::optional<double> changed_s_;
  bool alive_ = false;
};

}  // namespace plumbline
