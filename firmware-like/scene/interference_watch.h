// Interference detector with hysteresis for one pair of objects.
#pragma once

#include <optional>

namespace plumbline::scene {

enum class Proximity { kApart, kNear, kInterference };

/// Distance thresholds of a pair.
struct ProximityLimits {
  double near_m = 0;  ///< kNear up to this distance; 0: only interference is reported
  double end_m = 0;   ///< hysteresis: a state ends this far beyond its threshold
};

/// Tracks one pair of objects. Interference starts on contact, proximity at near_m; each ends only
/// when the distance exceeds its threshold by end_m, so that a vibrating tool is reported once. A
/// pair that cannot be measured (a tag is hidden) keeps its state.
class InterferenceWatch {
 public:
  explicit InterferenceWatch(const ProximityLimits& limits) : limits_(limits) {}

  /// @param distance_m  0 on contact; nullopt if not measured; a non-finite value counts as such
  /// @return            the new state if it changed
  std::optional<Proximity> Update(std::optional<double> distance_m);

  Proximity state() const { return state_; }
  bool measured() const { return measured_; }  ///< the last update had a distance

 private:
  const ProximityLimits limits_;
  Proximity state_ = Proximity::kApart;
  bool measured_ = false;
};

}  // namespace plumbline::scene
