// What the daemon asks of a zoom sensor, whatever it is reached through.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "firmware-like/lens/zoom_reading.h"

namespace plumbline {

/// How often a sensor is read: 10 Hz, so that a change is known within 0.2 s.
inline constexpr double kZoomPeriod_s = 0.1;
/// Of sensors that answer at once: so often that a motion is seen while it lasts.
inline constexpr double kQuickZoomPeriod_s = 0.05;

enum class ZoomResult : std::uint8_t {
  kOk,
  kWaiting,   ///< not connected; the next attempt is not due yet
  kTimeout,   ///< connected, but no answer in time
  kLost,      ///< cannot be opened, or went away
  kProtocol,  ///< answers that make no sense
  kRefused,   ///< the device answers that it cannot tell
};

/// Words for a log line: "no answer in time".
std::string_view ZoomResultText(ZoomResult result);

/// A zoom sensor. Used by one thread. A call connects by itself where it must, and ends within the
/// device's time-out, whatever the device does.
class ZoomSensor {
 public:
  ZoomSensor() = default;
  ZoomSensor(const ZoomSensor&) = delete;
  ZoomSensor& operator=(const ZoomSensor&) = delete;
  virtual ~ZoomSensor() = default;

  /// `reading` is complete where kOk is answered and unchanged otherwise.
  virtual ZoomResult Read(ZoomReading& reading) = 0;

  /// What the last call that was not kOk met, with its place and what to do; stays while kWaiting
  /// is answered, valid until the next call.
  virtual std::string_view problem() const = 0;
};

}  // namespace plumbline
