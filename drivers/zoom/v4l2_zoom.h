// A camera that tells its zoom as a V4L2 control.
#pragma once

#include <memory>
#include <string>

#include "drivers/os/descriptor.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

struct v4l2_event;

namespace plumbline {

struct V4l2ZoomOptions {
  std::string device;      ///< a path, or the camera's name as SelectV4l2Device() takes it
  double timeout_s = 0.1;  ///< how long a Read() waits for a change
};

/// What an event says of zoom or focus goes into `reading`. @return whether it says anything
bool ReadingFromEvent(const v4l2_event& event, ZoomReading& reading);

/// Subscribes to changes of V4L2_CID_ZOOM_ABSOLUTE (and FOCUS_ABSOLUTE where there is one). Read()
/// returns with the first of them, or after the time-out with the controls read anew: a camera that
/// somebody else moves sends events only where its firmware reports by interrupt. Digital zoom and
/// motion are not told. The device may be open for capture elsewhere.
class V4l2Zoom : public ZoomSensor {
 public:
  /// Refuses a time-out outside 0.01..10 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(const V4l2ZoomOptions& options, Clock clock);

  ZoomResult Read(ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  V4l2Zoom(V4l2ZoomOptions options, Clock clock);
  bool Open();
  bool Subscribe(std::uint32_t control) const;
  /// False where the device went away.
  bool ReadControls();
  ZoomResult Lost(const std::string& why);

  const V4l2ZoomOptions options_;
  const Clock clock_;
  Descriptor fd_;
  BackOff back_off_;
  bool has_focus_ = false;
  ZoomReading last_;
  std::string problem_;
};

/// A camera's zoom control.
extern const ZoomKind kV4l2ZoomKind;

}  // namespace plumbline
