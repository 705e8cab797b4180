// Status of the virtual objects: interference and smallest distance.
#pragma once

#include <cstdint>
#include <limits>

namespace plumbline::status {

/// Measured by the daemon in the deflected state, for the pairs listed in the object table.
struct SceneStatus {
  static constexpr double kFresh_s = 1.0;    ///< an older status is treated as unknown
  std::uint32_t interferences = 0;           ///< pairs in interference, hysteresis included
  std::uint32_t near = 0;                    ///< pairs nearer than their declared distance
  std::uint32_t unmeasured = 0;              ///< pairs with an object that is hidden or not placed
  double smallest_m = 0;                     ///< smallest measured distance; 0: contact
  std::uint16_t object_a = 0, object_b = 0;  ///< object numbers of that pair; 0: none measured
  double time_s = -std::numeric_limits<double>::infinity();  ///< when it was measured, monotonic
  std::uint32_t blocked = 0;  ///< approach paths blocked by an object

  bool FreshAt(double now_s) const { return now_s - time_s <= kFresh_s; }
};

}  // namespace plumbline::status
