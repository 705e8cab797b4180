// A dial gauge on a serial line that sends its reading when its button is pressed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/gauge/gauge_codec.h"
#include "drivers/os/descriptor.h"

namespace plumbline::gauge {

struct SerialGaugeOptions {
  std::string device;  ///< for example /dev/serial/by-id/...
  const GaugeFormat* format = nullptr;
  os::SerialSettings line;
  GaugeUnit unit = GaugeUnit::kMillimetre;  ///< that the gauge is set to, if it does not send it

  bool operator==(const SerialGaugeOptions&) const = default;
};

enum class GaugeResult : std::uint8_t {
  kNothing,  ///< connected; no button was pressed
  kReading,
  kFault,       ///< the gauge reports a fault
  kUnreadable,  ///< a line that is not of the format or was interrupted, or lines without a pause
  kWaiting,     ///< not connected; the next attempt is not due yet
  kLost,        ///< cannot be opened, or was disconnected
};

/// Not thread-safe. Reconnects by itself: after 0.1 s, then up to once a second.
class SerialGauge {
 public:
  /// @param options  with a format and line settings without fault
  explicit SerialGauge(SerialGaugeOptions options, Clock clock = MonotonicSeconds);

  /// Waits up to `timeout_s` for one line. `reading_m` is set if kReading is returned. Lines that
  /// started before the gauge had been silent for 0.2 s after the connection are discarded, because
  /// their beginning may be lost.
  GaugeResult Read(double timeout_s, double& reading_m);

  /// Why the last call returned kFault, kUnreadable or kLost, with the remedy.
  std::string_view problem() const { return problem_; }
  /// True from a successful connection until kLost.
  bool connected() const { return static_cast<bool>(fd_); }
  const SerialGaugeOptions& options() const { return options_; }

 private:
  bool Open();
  GaugeResult Lose(const std::string& why);
  GaugeResult Unreadable(const std::string& why);
  GaugeResult Judge(std::string_view text, double& reading_m);

  SerialGaugeOptions options_;
  Clock clock_;
  os::Descriptor fd_;
  BackOff back_off_;
  LineReceiver receiver_;
  bool interrupted_ = false;  ///< the received part of a line is followed by a pause
  double opened_s_ = 0;
  bool settled_ = false;    ///< the line was silent once since the connection
  double last_byte_s_ = 0;  ///< or the connection
  std::string unread_;      ///< received after the line that was returned
  std::string problem_;
};

}  // namespace plumbline::gauge
