// Zoom sensor that reads the zoom control of a V4L2 camera.
#pragma once

#include <memory>
#include <string>

#include "drivers/os/descriptor.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

struct v4l2_event;

namespace plumbline::zoom {

struct V4l2ZoomOptions {
  std::string device;                     ///< path or camera name, see SelectV4l2Device()
  double timeout_s = kQuickZoomPeriod_s;  ///< how long Read() waits for a change
};

/// Decodes a zoom or focus change from an event into `reading`. @return true if it was one
bool ReadingFromEvent(const v4l2_event& event, lens::ZoomReading& reading);

/// Subscribes to changes of V4L2_CID_ZOOM_ABSOLUTE, and of FOCUS_ABSOLUTE if the camera has it.
/// Read() returns at the first change, or after the timeout with the controls read again, because
/// a camera sends events for changes made elsewhere only if its firmware reports them by interrupt.
/// Digital zoom and motion are not reported. The device may be open for capture at the same time.
class V4l2Zoom : public ZoomSensor {
 public:
  /// Fails for a timeout outside 0.01..10 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(const V4l2ZoomOptions& options, Clock clock);

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  V4l2Zoom(V4l2ZoomOptions options, Clock clock);
  bool Open();
  bool Subscribe(std::uint32_t control) const;
  /// Reads the controls into last_. Returns false if the device is gone.
  bool ReadControls();
  ZoomResult Disconnect(const std::string& why);

  const V4l2ZoomOptions options_;
  const Clock clock_;
  os::Descriptor fd_;
  BackOff back_off_;
  bool has_focus_ = false;
  lens::ZoomReading last_;
  std::string problem_;
};

/// Zoom kind "v4l2".
extern const ZoomKind kV4l2ZoomKind;

}  // namespace plumbline::zoom
