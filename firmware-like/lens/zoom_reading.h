// Reading of a zoom sensor, independent of its interface.
#pragma once

#include <cstdint>
#include <optional>

namespace plumbline::lens {

enum class LensMotion : std::uint8_t {
  kUnknown,  ///< not reported by the device
  kSettled,
  kMoving,
};

/// One response of a zoom sensor. Fields that the sensor does not provide are absent.
struct ZoomReading {
  std::optional<std::int32_t> zoom_counts;   ///< encoder position in counts of the device
  std::optional<std::int32_t> focus_counts;  ///< likewise
  std::optional<bool> digital_zoom;          ///< the image is enlarged digitally
  LensMotion motion = LensMotion::kUnknown;
  bool moved = false;  ///< the sensor signalled motion since the last reading, position unknown
  double time_s = 0;   ///< monotonic time of the response
};

}  // namespace plumbline::lens
