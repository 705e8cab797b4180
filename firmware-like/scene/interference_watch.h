// Interference detector with hysteresis for one pair of objects.
#pragma once

#include <optional>

namespace plumbline {

enum class Nearness { kApart, kNear, kInterference };

/// Distance thresholds of a pair.
struct NearnessLimits {
  double near_m = 0;  ///< kNear up to this distance; 0: only interference is reported
  double end_m = 0;   ///< hysteresis: a state ends this far beyond its threshold
};

/// Tracks one pair of objects. Interference starts on contact, proximity at near_m; each ends only
/// when the distance exceeds its threshold by end_m, so that a vibrating tool is reported once. A
/// pair that cannot be measured (a tag is hidden) keeps its state.
class InterferenceWatch {
 public:
  explicit InterferenceWatch(const NearnessLimits& limits) : limits_(limits) {}

  /// @param distance_m  0 on contact; nullopt if not measured; a non-finite value counts as such
  /// @return            the new state if it changed
  std::optional<Nearness> Update(std::optional<double> distance_m);

  Nearness state() const { return state_; }
  bool measured() const { return measured_; }  ///< the last update had a distance

 private:
  const NearnessLimits limits_;
  Nearness state_ = Nearness::kApart;
  bool measured_ = false;
};

}  // namespace plumbline
