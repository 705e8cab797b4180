#include "drivers/zoom/v4l2_zoom.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/camera/v4l2_device.h"
#include "drivers/files/open_failure.h"
#include "drivers/ioctl.h"
#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

constexpr ZoomOption kV4l2ZoomOptions[] = {
    {.key = "device",
     .value = [](ZoomConnection& to) -> std::string& { return to.v4l2.device; },
     .required = true,
     .camera_device = true},
};

bool HasControl(int fd, std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  return IoctlAgain(fd, VIDIOC_QUERYCTRL, &query) == 0 &&
         (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0;
}

}  // namespace

bool ReadingFromEvent(const v4l2_event& event, lens::ZoomReading& reading) {
  if (event.type != V4L2_EVENT_CTRL || (event.u.ctrl.changes & V4L2_EVENT_CTRL_CH_VALUE) == 0) {
    return false;
  }
  if (event.id == V4L2_CID_ZOOM_ABSOLUTE) {
    reading.zoom_counts = event.u.ctrl.value;
  } else if (event.id == V4L2_CID_FOCUS_ABSOLUTE) {
    reading.focus_counts = event.u.ctrl.value;
  } else {
    return false;
  }
  return true;
}

Result<std::unique_ptr<ZoomSensor>> V4l2Zoom::Create(const V4l2ZoomOptions& options, Clock clock) {
  if (!(options.timeout_s >= 0.01 && options.timeout_s <= 10)) {
    return Error{fmt::format("v4l2 zoom: timeout {} s is outside 0.01..10", options.timeout_s)};
  }
  return std::unique_ptr<ZoomSensor>(new V4l2Zoom(options, clock));
}

V4l2Zoom::V4l2Zoom(V4l2ZoomOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock) {}

ZoomResult V4l2Zoom::Disconnect(const std::string& why) {
  fd_.Reset();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{}: {}", options_.device, why);
  return ZoomResult::kLost;
}

bool V4l2Zoom::Subscribe(std::uint32_t control) const {
  v4l2_event_subscription subscription{};
  subscription.type = V4L2_EVENT_CTRL;
  subscription.id = control;
  subscription.flags = V4L2_EVENT_SUB_FL_SEND_INITIAL;
  return IoctlAgain(fd_.get(), VIDIOC_SUBSCRIBE_EVENT, &subscription) == 0;
}

bool V4l2Zoom::Open() {
  std::string path = options_.device;
  if (!path.starts_with('/')) {  // a camera name: its device node may have changed
    const auto camera = camera::SelectV4l2Device(path, camera::ListV4l2Devices());
    if (!camera) {
      Disconnect(camera.error());
      return false;
    }
    path = camera.value().path;
  }
  fd_.Reset(open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd_) {
    Disconnect(files::OpenErrorText(errno, files::kCameraDevice));
    return false;
  }
  if (!HasControl(fd_.get(), V4L2_CID_ZOOM_ABSOLUTE)) {
    Disconnect("has no zoom control. Check with v4l2-ctl --list-ctrls.");
    return false;
  }
  last_ = lens::ZoomReading{};
  has_focus_ = HasControl(fd_.get(), V4L2_CID_FOCUS_ABSOLUTE);
  // Errors are ignored: a camera without events is polled.
  Subscribe(V4L2_CID_ZOOM_ABSOLUTE);
  if (has_focus_) Subscribe(V4L2_CID_FOCUS_ABSOLUTE);
  return true;
}

bool V4l2Zoom::ReadControls() {
  v4l2_control control{};
  control.id = V4L2_CID_ZOOM_ABSOLUTE;
  if (IoctlAgain(fd_.get(), VIDIOC_G_CTRL, &control) != 0) return false;
  last_.zoom_counts = control.value;
  if (!has_focus_) return true;
  control.id = V4L2_CID_FOCUS_ABSOLUTE;
  if (IoctlAgain(fd_.get(), VIDIOC_G_CTRL, &control) == 0) last_.focus_counts = control.value;
  return true;
}

ZoomResult V4l2Zoom::Read(lens::ZoomReading& reading) {
  if (!fd_) {
    if (!back_off_.Due(clock_())) return ZoomResult::kWaiting;
    if (!Open()) return ZoomResult::kLost;
  }
  const bool first = !last_.zoom_counts;
  pollfd wait{.fd = fd_.get(), .events = POLLPRI, .revents = 0};
  const int wait_ms = first ? 0 : static_cast<int>(std::ceil(1e3 * options_.timeout_s));
  bool zoom_changed = false;
  if (poll(&wait, 1, wait_ms) > 0 && (wait.revents & POLLPRI) != 0) {
    v4l2_event event{};
    do {
      if (IoctlAgain(fd_.get(), VIDIOC_DQEVENT, &event) != 0) break;
      if (ReadingFromEvent(event, last_))
        zoom_changed = zoom_changed || event.id == V4L2_CID_ZOOM_ABSOLUTE;
    } while (event.pending > 0);
  }
  if (!zoom_changed && !ReadControls()) {
    return Disconnect(fmt::format("lost: {}. Check its cable.", std::strerror(errno)));
  }
  back_off_.Well();
  last_.time_s = clock_();
  reading = last_;
  return ZoomResult::kOk;
}

const ZoomKind kV4l2ZoomKind{
    .name = "v4l2",
    .make = [](const ZoomConnection& to) { return V4l2Zoom::Create(to.v4l2, to.clock); },
    .identity = [](const ZoomConnection& to) { return to.v4l2.device; },
    .device = [](const ZoomConnection& to) -> Result<std::string> {
      const auto device = camera::SelectV4l2Device(to.v4l2.device, camera::ListV4l2Devices());
      if (!device) return device.failure();
      return device->path;
    },
    .remedy = "plug in the camera; add the user to the group video",
    .period_s = kQuickZoomPeriod_s,
    .options = kV4l2ZoomOptions};

}  // namespace plumbline::zoom
