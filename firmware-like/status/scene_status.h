// Status of the virtual objects: interference and the smallest distance between them.
#pragma once

#include <cstdint>
#include <limits>

namespace plumbline {

/// Measured by plumbline-view in the deflected state, for the pairs that its object table names.
struct SceneStatus {
  static constexpr double kFresh_s = 1.0;    ///< an older status is unknown
  std::uint32_t interferences = 0;           ///< pairs that touch, hysteresis included
  std::uint32_t unmeasured = 0;              ///< pairs whose objects are not placed, or hidden
  double smallest_m = 0;                     ///< of the measured pairs; 0: one touches
  std::uint16_t object_a = 0, object_b = 0;  ///< numbers of that pair's objects; 0: none measured
  double time_s = -std::numeric_limits<double>::infinity();  ///< when it arrived, monotonic
  std::uint32_t blocked = 0;  ///< approach paths with an object on them

  bool FreshAt(double now_s) const { return now_s - time_s <= kFresh_s; }
};

}  // namespace plumbline
