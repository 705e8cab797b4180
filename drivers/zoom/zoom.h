// Interface of a zoom sensor, independent of its connection.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "firmware-like/lens/zoom_reading.h"

namespace plumbline::zoom {

/// Default reading period [s]: a change is detected within 0.2 s.
inline constexpr double kZoomPeriod_s = 0.1;
/// Reading period of sensors that answer immediately [s]: short enough to observe a motion in
/// progress.
inline constexpr double kQuickZoomPeriod_s = 0.05;

enum class ZoomResult : std::uint8_t {
  kOk,
  kWaiting,   ///< not connected; the next attempt is not due yet
  kTimeout,   ///< connected, but no answer in time
  kLost,      ///< cannot be opened, or was disconnected
  kProtocol,  ///< invalid answers
  kRefused,   ///< the device rejects the inquiry
};

/// Text for the log, for example "no answer in time".
std::string_view ZoomResultText(ZoomResult result);

/// A zoom sensor. Not thread-safe. A call connects if necessary and returns within the configured
/// timeout, whatever the device does.
class ZoomSensor {
 public:
  ZoomSensor() = default;
  ZoomSensor(const ZoomSensor&) = delete;
  ZoomSensor& operator=(const ZoomSensor&) = delete;
  virtual ~ZoomSensor() = default;

  /// Reads once. `reading` is complete if kOk is returned and unchanged otherwise.
  virtual ZoomResult Read(lens::ZoomReading& reading) = 0;

  /// Error of the last call that did not return kOk, with its location and the remedy; unchanged
  /// while Read() returns kWaiting, valid until the next call.
  virtual std::string_view problem() const = 0;
};

}  // namespace plumbline::zoom
