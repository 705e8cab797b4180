// Zoom sensor with HID reports, through hidapi (hidraw).
#pragma once

#include <memory>
#include <string>

#include "drivers/hid/hid_device.h"
#include "drivers/zoom/hid_codec.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct HidOptions {
  HidProfile profile;
  std::string serial;  ///< selects one of several equal devices; empty: any
  double timeout_s = 0.1;
};

/// Each Read() runs all exchanges of the profile. Older unread reports are discarded first.
/// Any failure closes the device, which also discards a late answer; it is reopened after 0.1 s,
/// 0.2 s, up to 1 s.
class HidZoom : public ZoomSensor {
 public:
  /// Fails for a profile with a fault and for a timeout outside 0.01..10 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(HidOptions options, Clock clock);

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  HidZoom(HidOptions options, Clock clock);
  hid::HidName Name() const;
  bool Open();
  ZoomResult Query(const HidExchange& exchange, double deadline_s, lens::ZoomReading& reading);
  ZoomResult Receive(const HidExchange& exchange, double deadline_s, lens::ZoomReading& reading);
  ZoomResult Fail(ZoomResult result, const std::string& why);

  const HidOptions options_;
  const Clock clock_;
  hid::HidDevice device_;
  BackOff back_off_;
  lens::ZoomReading received_;  ///< last report of an unsolicited device
  bool has_received_ = false;
  std::string problem_;
};

/// Zoom kind "hid".
extern const ZoomKind kHidKind;

}  // namespace plumbline::zoom
