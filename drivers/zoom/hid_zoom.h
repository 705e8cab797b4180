// A lens that tells its zoom by HID reports, through hidapi (hidraw).
#pragma once

#include <memory>
#include <string>

#include "drivers/zoom/hid_codec.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

struct hid_device_;  // hidapi's hid_device

namespace plumbline {

struct HidOptions {
  HidProfile profile;
  std::string serial;  ///< of two equal devices; empty: the only one, or any
  double timeout_s = 0.1;
};

/// Each Read() runs through all exchanges of the profile. Reports that lie unread from before are
/// thrown away first. Whatever fails closes the device, so that a late answer is lost with it; it
/// is opened again after 0.1 s, 0.2 s, .. 1 s.
class HidZoom : public ZoomSensor {
 public:
  /// Refuses a profile that FaultOf() refuses, and a time-out outside 0.01..10 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(HidOptions options, Clock clock);
  ~HidZoom() override;

  ZoomResult Read(ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  HidZoom(HidOptions options, Clock clock);
  bool Open();
  ZoomResult Ask(const HidExchange& exchange, double deadline_s, ZoomReading& reading);
  ZoomResult Listen(const HidExchange& exchange, double deadline_s, ZoomReading& reading);
  ZoomResult Fail(ZoomResult result, const std::string& why);

  const HidOptions options_;
  const Clock clock_;
  hid_device_* device_ = nullptr;
  BackOff back_off_;
  ZoomReading heard_;  ///< of a device that speaks unasked
  bool heard_any_ = false;
  std::string problem_;
};

/// A lens or encoder with reports of its own, by a profile.
extern const ZoomKind kHidKind;

}  // namespace plumbline
