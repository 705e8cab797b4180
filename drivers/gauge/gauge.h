// A dial gauge that sends its reading when its button is pressed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/gauge/gauge_codec.h"
#include "drivers/hid/hid_device.h"
#include "drivers/hid/hid_name.h"
#include "drivers/hid/keyboard_grab.h"

namespace plumbline::gauge {

// Interface of the connection over which a dial gauge sends its text.

/// Not thread-safe. Does not reconnect by itself.
class GaugePort {
 public:
  GaugePort() = default;
  virtual ~GaugePort() = default;
  GaugePort(const GaugePort&) = delete;
  GaugePort& operator=(const GaugePort&) = delete;

  /// @return  false if it cannot be opened; see problem()
  virtual bool Open() = 0;
  virtual void Close() = 0;
  virtual bool is_open() const = 0;
  /// Waits up to `timeout_s` for data and appends them to `text`. Requires an open port.
  /// @return  false if the connection was lost; see problem()
  virtual bool Receive(double timeout_s, std::string& text) = 0;

  /// Device, as messages name it.
  virtual std::string name() const = 0;
  /// What to check if the data are not of the configured format.
  virtual std::string settings_to_check() const = 0;
  /// Why Open() or Receive() failed, with the remedy.
  const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

// Dial gauge, or the interface of one, as a HID device.

/// A device that types is opened only if its keys can be taken exclusively.
class HidPort : public GaugePort {
 public:
  explicit HidPort(hid::HidName id, hid::InputFolders folders = {});

  bool Open() override;
  void Close() override;
  bool is_open() const override { return static_cast<bool>(device_); }
  bool Receive(double timeout_s, std::string& text) override;
  std::string name() const override { return NameText(id_); }
  std::string settings_to_check() const override { return "`format` of [[gauge]]"; }

 private:
  const hid::HidName id_;
  hid::HidDevice device_;
  hid::KeyboardGrab grab_;
  bool keyboard_ = false;
  KeyReports keys_;
};

enum class GaugeKind : std::uint8_t { kSerial, kHid };

struct GaugeOptions {
  GaugeKind kind = GaugeKind::kSerial;
  std::string device;       ///< serial: for example /dev/serial/by-id/...
  os::SerialSettings line;  ///< serial
  hid::HidName hid;         ///< HID
  const GaugeFormat* format = nullptr;
  GaugeUnit unit = GaugeUnit::kMillimetre;  ///< that the gauge is set to, if it does not send it

  bool operator==(const GaugeOptions&) const = default;
};

enum class GaugeResult : std::uint8_t {
  kNothing,  ///< connected; no button was pressed
  kReading,
  kFault,       ///< the gauge reports a fault
  kUnreadable,  ///< data that are not a line of the format, or lines without a pause
  kWaiting,     ///< not connected; the next attempt is not due yet
  kLost,        ///< cannot be opened, or was disconnected
};

/// Not thread-safe. Reconnects by itself: after 0.1 s, then up to once a second.
class Gauge {
 public:
  /// @param options  with a format and line settings without fault
  explicit Gauge(GaugeOptions options, Clock clock = MonotonicSeconds);
  /// @param port  replaces the one that the options describe
  Gauge(GaugeOptions options, std::unique_ptr<GaugePort> port, Clock clock);

  /// Waits up to `timeout_s` for one line. `reading_m` is set if kReading is returned. Lines that
  /// started before the gauge had been silent for 0.2 s after the connection are discarded, because
  /// their beginning may be lost. Data that do not end a line are reported once.
  GaugeResult Read(double timeout_s, double& reading_m);

  /// Why the last call returned kFault, kUnreadable or kLost, with the remedy.
  std::string_view problem() const { return problem_; }
  /// True from a successful connection until kLost.
  bool connected() const { return port_->is_open(); }
  const GaugeOptions& options() const { return options_; }

 private:
  bool Open();
  GaugeResult Lose();
  GaugeResult Unreadable(const std::string& why);
  GaugeResult NotOfFormat(std::string_view text, std::string_view what);
  GaugeResult Silence(double now_s);
  GaugeResult TakeLine(double now_s, double& reading_m);
  GaugeResult Judge(std::string_view text, double& reading_m);
  bool WasSilent(double now_s) const;
  bool NeverSilent(double now_s) const;

  GaugeOptions options_;
  std::unique_ptr<GaugePort> port_;
  Clock clock_;
  BackOff back_off_;
  LineReceiver receiver_;
  bool interrupted_ = false;     ///< the received part of a line is followed by a pause
  bool endless_logged_ = false;  ///< data without the end of a line were reported
  double opened_s_ = 0;
  bool settled_ = false;    ///< the line was silent once since the connection
  double last_byte_s_ = 0;  ///< or the connection
  std::string unread_;      ///< received after the line that was returned
  std::string problem_;
};

}  // namespace plumbline::gauge
