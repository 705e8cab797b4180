// When a "lens moved" line means it. Pure.
#pragma once

namespace plumbline {

/// Told edges with their times, says whether the line was active long enough since it was last
/// asked. A burst begins with a rising edge and goes on over gaps shorter than `debounce_s`, so
/// that a bouncing contact or a pulsed motor counts as one; a burst shorter than that is a spike.
class LineDebounce {
 public:
  explicit LineDebounce(double debounce_s) : debounce_s_(debounce_s) {}

  /// Times ascend; an edge to the level that stands already changes nothing.
  void Edge(bool active, double time_s) {
    if (active == active_) return;
    active_ = active;
    if (active) {
      if (!(time_s - fell_s_ < debounce_s_)) rose_s_ = time_s;
    } else {
      fell_s_ = time_s;
      Judge(time_s);
    }
  }

  /// Active now, and for long enough.
  bool Moving(double now_s) {
    if (active_) Judge(now_s);
    return active_ && now_s - rose_s_ >= debounce_s_;
  }

  /// Whether it was active for long enough at any time since the last call.
  bool TakeMoved(double now_s) {
    const bool moved = Moving(now_s) || moved_;
    moved_ = false;
    return moved;
  }

 private:
  void Judge(double time_s) { moved_ = moved_ || time_s - rose_s_ >= debounce_s_; }

  double debounce_s_;
  bool active_ = false;
  bool moved_ = false;
  double rose_s_ = 0;
  double fell_s_ = -1e300;
};

}  // namespace plumbline
