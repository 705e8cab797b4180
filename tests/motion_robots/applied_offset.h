// What a controller makes of the answers to its packets, and how far it jumps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace motion_robots {

using Vector = std::array<double, 3>;  // [mm]

inline double Length(const Vector& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}
inline double Distance(const Vector& a, const Vector& b) {
  return Length({a[0] - b[0], a[1] - b[1], a[2] - b[2]});
}

struct AppliedOptions {
  bool hold_on = true;   ///< HOLDON: keep the last value without an answer
  int timeout = 10;      ///< cycles in a row without an answer that are tolerated
  bool absolute = true;  ///< false: each answer is added
  double limit_mm = 5;   ///< per axis
  bool clips = true;     ///< at the limit; false: stops
};

class AppliedOffset {
 public:
  explicit AppliedOffset(AppliedOptions options) : options_(options) {}

  /// At the end of a cycle. @param answer  nullopt: none has arrived, or none that counts
  void EndCycle(const std::optional<Vector>& answer) {
    if (stopped_) return;
    Vector next = now_;
    if (answer) {
      missing_ = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        next[k] = (options_.absolute ? 0 : now_[k]) + (*answer)[k];
        if (std::abs(next[k]) <= options_.limit_mm) continue;
        if (!options_.clips) return Stop();
        next[k] = std::clamp(next[k], -options_.limit_mm, options_.limit_mm);
      }
    } else {
      ++late_;
      if (!options_.hold_on && options_.absolute) next = {};
      if (++missing_ > options_.timeout) Stop();
    }
    largest_jump_mm_ = std::max(largest_jump_mm_, Distance(next, now_));
    largest_mm_ = std::max(largest_mm_, Length(next));
    now_ = next;
    if (Length(now_) > 0) ++corrected_;
  }
  /// A new start of the sensor interface: from 0.
  void Start() {
    now_ = {};
    missing_ = 0;
    stopped_ = false;
  }
  void Stop() {
    stopped_ = true;
    ++stops_;
  }

  const Vector& now() const { return now_; }
  bool stopped() const { return stopped_; }
  long late() const { return late_; }
  long stops() const { return stops_; }
  long corrected() const { return corrected_; }  ///< cycles with an offset
  double largest_jump_mm() const { return largest_jump_mm_; }
  double largest_mm() const { return largest_mm_; }

 private:
  AppliedOptions options_;
  Vector now_{};
  int missing_ = 0;
  bool stopped_ = false;
  long late_ = 0, stops_ = 0, corrected_ = 0;
  double largest_jump_mm_ = 0, largest_mm_ = 0;
};

}  // namespace motion_robots
