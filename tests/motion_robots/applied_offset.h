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

struct Correction {
  Vector mm{};
  Vector abc_deg{};  ///< about Z, then the turned Y, then the turned X
};

/// Angle between two orientations [deg].
inline double Turn_deg(const Vector& a_deg, const Vector& b_deg) {
  constexpr double kRad = 0.017453292519943295;
  const auto rotation = [](const Vector& abc) {
    const double ca = std::cos(kRad * abc[0]), sa = std::sin(kRad * abc[0]);
    const double cb = std::cos(kRad * abc[1]), sb = std::sin(kRad * abc[1]);
    const double cc = std::cos(kRad * abc[2]), sc = std::sin(kRad * abc[2]);
    return std::array<double, 9>{ca * cb,
                                 ca * sb * sc - sa * cc,
                                 ca * sb * cc + sa * sc,
                                 sa * cb,
                                 sa * sb * sc + ca * cc,
                                 sa * sb * cc - ca * sc,
                                 -sb,
                                 cb * sc,
                                 cb * cc};
  };
  const auto a = rotation(a_deg), b = rotation(b_deg);
  double squares = 0;
  for (std::size_t k = 0; k < 9; ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  return 2 * std::asin(std::min(1.0, std::sqrt(squares / 8))) / kRad;
}

struct AppliedOptions {
  bool hold_on = true;       ///< HOLDON: keep the last value without an answer
  int timeout = 10;          ///< cycles in a row without an answer that are tolerated
  bool absolute = true;      ///< false: each answer is added
  double limit_mm = 5;       ///< per axis
  bool clips = true;         ///< at the limit; false: stops
  bool pause_drops = false;  ///< while corrections are paused: back to 0; false: keeps the last
};

class AppliedOffset {
 public:
  explicit AppliedOffset(AppliedOptions options) : options_(options) {}

  /// At the end of a cycle. @param answer  nullopt: none has arrived, or none that counts
  void EndCycle(const std::optional<Correction>& answer) {
    if (stopped_) return;
    Vector next = now_, next_deg = now_deg_;
    if (answer) {
      missing_ = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        next[k] = (options_.absolute ? 0 : now_[k]) + answer->mm[k];
        if (std::abs(next[k]) <= options_.limit_mm) continue;
        if (!options_.clips) return Stop();
        next[k] = std::clamp(next[k], -options_.limit_mm, options_.limit_mm);
      }
      next_deg = answer->abc_deg;
    } else {
      ++late_;
      if (!options_.hold_on && options_.absolute) next = next_deg = {};
      if (++missing_ > options_.timeout) Stop();
    }
    largest_jump_mm_ = std::max(largest_jump_mm_, Distance(next, now_));
    largest_mm_ = std::max(largest_mm_, Length(next));
    largest_turn_deg_ = std::max(largest_turn_deg_, Turn_deg(next_deg, now_deg_));
    if (Length(next_deg) > 0) ++turned_;
    now_ = next;
    now_deg_ = next_deg;
    if (Length(now_) > 0) ++corrected_;
  }
  /// At the end of a cycle in which the controller applies no corrections. What it does with the
  /// present one is its own affair, and no jump.
  void Pause(bool answered) {
    if (stopped_) return;
    if (options_.pause_drops) now_ = now_deg_ = {};
    missing_ = answered ? 0 : missing_ + 1;
    if (missing_ > options_.timeout) Stop();
  }
  /// A new start of the sensor interface: from 0.
  void Start() {
    now_ = now_deg_ = {};
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
  /// From one cycle to the next.
  double largest_turn_deg() const { return largest_turn_deg_; }
  long turned() const { return turned_; }  ///< cycles with a rotation
  double largest_mm() const { return largest_mm_; }

 private:
  AppliedOptions options_;
  Vector now_{}, now_deg_{};
  int missing_ = 0;
  bool stopped_ = false;
  long late_ = 0, stops_ = 0, corrected_ = 0, turned_ = 0;
  double largest_jump_mm_ = 0, largest_mm_ = 0, largest_turn_deg_ = 0;
};

}  // namespace motion_robots
