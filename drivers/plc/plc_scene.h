// What the PLC is told of virtual objects: interference and the smallest distance.
#pragma once

#include <cstdint>
#include <limits>

namespace plumbline {

/// Measured by plumbline-view in the deflected state, of the pairs that its object table names.
struct PlcScene {
  static constexpr double kFresh_s = 1.0;    ///< older than this: nothing is known
  std::uint32_t interferences = 0;           ///< pairs that touch, or have not ended to
  std::uint32_t unmeasured = 0;              ///< pairs whose objects are not in place, or hidden
  double smallest_m = 0;                     ///< of the measured pairs; 0: one touches
  std::uint16_t object_a = 0, object_b = 0;  ///< numbers of that pair's objects; 0: none measured
  double time_s = -std::numeric_limits<double>::infinity();  ///< when it was told, monotonic
  std::uint32_t blocked = 0;  ///< approach paths with an object on them
};

}  // namespace plumbline
