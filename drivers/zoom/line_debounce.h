// Debouncing of a "lens moved" input. Pure.
#pragma once

namespace plumbline::zoom {

/// Decides from time-stamped edges whether the line was active for long enough. A burst starts with
/// a rising edge and continues across gaps shorter than `debounce_s`, so that a bouncing contact or
/// a pulsed motor counts as one burst; a burst shorter than that is ignored as a spike.
class LineDebounce {
 public:
  explicit LineDebounce(double debounce_s) : debounce_s_(debounce_s) {}

  /// Adds an edge. Times must ascend; an edge to the current level has no effect.
  void Edge(bool active, double time_s) {
    if (active == active_) return;
    active_ = active;
    if (active) {
      if (!(time_s - fell_s_ < debounce_s_)) rose_s_ = time_s;
    } else {
      fell_s_ = time_s;
      Evaluate(time_s);
    }
  }

  /// True if the line is active now and has been for long enough.
  bool Moving(double now_s) {
    if (active_) Evaluate(now_s);
    return active_ && now_s - rose_s_ >= debounce_s_;
  }

  /// True if the line was active for long enough at any time since the last call.
  bool TakeMoved(double now_s) {
    const bool moved = Moving(now_s) || moved_;
    moved_ = false;
    return moved;
  }

 private:
  void Evaluate(double time_s) { moved_ = moved_ || time_s - rose_s_ >= debounce_s_; }

  double debounce_s_;
  bool active_ = false;
  bool moved_ = false;
  double rose_s_ = 0;
  double fell_s_ = -1e300;
};

}  // namespace plumbline::zoom
