// What a zoom sensor knows of the lens, whatever it is reached through.
#pragma once

#include <cstdint>
#include <optional>

namespace plumbline {

enum class LensMotion : std::uint8_t {
  kUnknown,  ///< the device does not tell
  kSettled,
  kMoving,
};

/// One answer of a zoom sensor. A sensor that cannot tell a field leaves it empty.
struct ZoomReading {
  std::optional<std::int32_t> zoom_counts;   ///< encoder position, the device's own counts
  std::optional<std::int32_t> focus_counts;  ///< likewise
  std::optional<bool> digital_zoom;          ///< true: the image is enlarged by computing
  LensMotion motion = LensMotion::kUnknown;
  bool moved = false;  ///< a line or event said "moved" since the last reading, position unknown
  double time_s = 0;   ///< monotonic time of the answer
};

}  // namespace plumbline
