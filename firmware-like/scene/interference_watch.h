// When the interference of two objects begins and ends.
#pragma once

#include <optional>

namespace plumbline {

enum class Nearness { kApart, kNear, kInterference };

/// What is told of a pair.
struct NearnessLimits {
  double near_m = 0;  ///< near up to here; 0: only interference is told
  double end_m = 0;   ///< how much further than a limit they must be apart for its state to end
};

/// Follows one pair. Interference begins as soon as the objects touch, nearness at near_m; each
/// ends only once they are further apart by end_m, so that a trembling tool is told once. A pair
/// that cannot be measured (a tag out of sight) stays what it was: nothing is known of an end.
class InterferenceWatch {
 public:
  explicit InterferenceWatch(const NearnessLimits& limits) : limits_(limits) {}

  /// @param distance_m  0 where they touch; nothing: not measured, or not finite
  /// @return            the new state where it changed
  std::optional<Nearness> Update(std::optional<double> distance_m);

  Nearness state() const { return state_; }
  bool measured() const { return measured_; }  ///< the last update had a distance

 private:
  const NearnessLimits limits_;
  Nearness state_ = Nearness::kApart;
  bool measured_ = false;
};

}  // namespace plumbline
