// V4L2 zoom against a fake kernel: ioctl() and poll() are replaced by the linker (--wrap), since no
// virtual driver has a zoom control.
#include "drivers/zoom/v4l2_zoom.h"

#include <linux/videodev2.h>
#include <poll.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdarg>
#include <deque>
#include <fstream>
#include <map>

#include "tests/app/temporary_folder.h"

namespace {

/// Simulated camera behind ioctl().
struct FakeKernel {
  std::map<std::uint32_t, int> controls;
  std::map<std::uint32_t, int> subscribed;
  std::deque<v4l2_event> events;
  bool gone = false;
  int reads = 0;
} kernel;

v4l2_event ValueEvent(std::uint32_t control, int value) {
  v4l2_event event{};
  event.type = V4L2_EVENT_CTRL;
  event.id = control;
  event.u.ctrl.changes = V4L2_EVENT_CTRL_CH_VALUE;
  event.u.ctrl.value = value;
  return event;
}

int Refuse(int error) {
  errno = error;
  return -1;
}

int Answer(unsigned long request, void* argument) {
  if (kernel.gone) return Refuse(ENODEV);
  if (request == VIDIOC_QUERYCTRL) {
    return kernel.controls.count(static_cast<v4l2_queryctrl*>(argument)->id) > 0 ? 0
                                                                                 : Refuse(EINVAL);
  }
  if (request == VIDIOC_SUBSCRIBE_EVENT) {
    const auto& subscription = *static_cast<v4l2_event_subscription*>(argument);
    kernel.subscribed[subscription.id] = static_cast<int>(subscription.flags);
    return subscription.type == V4L2_EVENT_CTRL ? 0 : Refuse(EINVAL);
  }
  if (request == VIDIOC_G_CTRL) {
    auto& control = *static_cast<v4l2_control*>(argument);
    ++kernel.reads;
    control.value = kernel.controls.at(control.id);
    return 0;
  }
  if (request == VIDIOC_DQEVENT) {
    if (kernel.events.empty()) return Refuse(ENOENT);
    *static_cast<v4l2_event*>(argument) = kernel.events.front();
    kernel.events.pop_front();
    static_cast<v4l2_event*>(argument)->pending = static_cast<std::uint32_t>(kernel.events.size());
    return 0;
  }
  return Refuse(ENOTTY);
}

}  // namespace

extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier)
int __wrap_ioctl(int, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  return Answer(request, argument);
}
int __wrap_poll(pollfd* fds, nfds_t, int) {
  fds->revents = kernel.events.empty() ? short{0} : short{POLLPRI};
  return kernel.events.empty() ? 0 : 1;
}
// NOLINTEND(bugprone-reserved-identifier)
}

namespace plumbline::v4l2_zoom_test {

using namespace plumbline::zoom;

namespace {

double now_s = 0;
double TestClock() {
  return now_s;
}

/// Sensor on a file that represents the device.
struct Camera {
  Camera() {
    kernel = FakeKernel{};
    kernel.controls = {{V4L2_CID_ZOOM_ABSOLUTE, 100}, {V4L2_CID_FOCUS_ABSOLUTE, 7}};
    path = folder.path() + "/video";
    std::ofstream(path) << "";
    sensor = std::move(V4l2Zoom::Create({.device = path}, TestClock)).value();
  }
  test::TemporaryFolder folder;
  std::string path;
  std::unique_ptr<ZoomSensor> sensor;
  lens::ZoomReading reading;
};

}  // namespace

TEST_CASE("v4l2: read at once, then updated by events, then by polling") {
  Camera camera;
  REQUIRE(camera.sensor->Read(camera.reading) == ZoomResult::kOk);
  CHECK(camera.reading.zoom_counts == 100);
  CHECK(camera.reading.focus_counts == 7);
  CHECK_FALSE(camera.reading.digital_zoom);
  CHECK(camera.reading.motion == lens::LensMotion::kUnknown);
  CHECK(kernel.subscribed.at(V4L2_CID_ZOOM_ABSOLUTE) == V4L2_EVENT_SUB_FL_SEND_INITIAL);
  CHECK(kernel.subscribed.count(V4L2_CID_FOCUS_ABSOLUTE) == 1);

  const int reads = kernel.reads;
  kernel.events = {ValueEvent(V4L2_CID_ZOOM_ABSOLUTE, 110), ValueEvent(V4L2_CID_BRIGHTNESS, 1),
                   ValueEvent(V4L2_CID_ZOOM_ABSOLUTE, 120)};
  REQUIRE(camera.sensor->Read(camera.reading) == ZoomResult::kOk);
  CHECK(camera.reading.zoom_counts == 120);  // the newest
  CHECK(kernel.reads == reads);

  kernel.controls[V4L2_CID_ZOOM_ABSOLUTE] = 130;  // moved without an event
  now_s = 5;
  REQUIRE(camera.sensor->Read(camera.reading) == ZoomResult::kOk);
  CHECK(camera.reading.zoom_counts == 130);
  CHECK(camera.reading.time_s == 5);
}

TEST_CASE("v4l2: anything that is not a path names a camera, as in [camera]") {
  kernel = FakeKernel{};
  const auto sensor = std::move(V4l2Zoom::Create({.device = "NOSUCH1"}, TestClock)).value();
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("no camera NOSUCH1 found"));
}

TEST_CASE("v4l2: a camera without focus, without zoom, unplugged and replugged, and missing") {
  Camera camera;
  kernel.controls.erase(V4L2_CID_FOCUS_ABSOLUTE);
  REQUIRE(camera.sensor->Read(camera.reading) == ZoomResult::kOk);
  CHECK_FALSE(camera.reading.focus_counts);
  kernel.gone = true;
  CHECK(camera.sensor->Read(camera.reading) == ZoomResult::kLost);
  CHECK(camera.reading.zoom_counts == 100);
  CHECK(camera.sensor->Read(camera.reading) == ZoomResult::kWaiting);
  kernel.gone = false;
  now_s += 1;
  CHECK(camera.sensor->Read(camera.reading) == ZoomResult::kOk);

  Camera fixed;
  kernel.controls.clear();
  CHECK(fixed.sensor->Read(fixed.reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(fixed.sensor->problem()), Catch::Contains("has no zoom control"));

  auto none = V4l2Zoom::Create({.device = "/dev/no-such-video"}, TestClock);
  REQUIRE(none);
  lens::ZoomReading reading;
  CHECK(none.value()->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(none.value()->problem()), Catch::Contains("is the camera plugged in"));
  CHECK_FALSE(V4l2Zoom::Create({.device = "", .timeout_s = 0}, TestClock).ok());
}

TEST_CASE("v4l2: only a changed zoom or focus value counts as a reading") {
  lens::ZoomReading reading;
  v4l2_event event = ValueEvent(V4L2_CID_ZOOM_ABSOLUTE, 5);
  event.u.ctrl.changes = V4L2_EVENT_CTRL_CH_FLAGS;
  CHECK_FALSE(ReadingFromEvent(event, reading));
  event = ValueEvent(V4L2_CID_ZOOM_ABSOLUTE, 5);
  event.type = V4L2_EVENT_SOURCE_CHANGE;
  CHECK_FALSE(ReadingFromEvent(event, reading));
  CHECK_FALSE(reading.zoom_counts);
  CHECK(ReadingFromEvent(ValueEvent(V4L2_CID_FOCUS_ABSOLUTE, -3), reading));
  CHECK(reading.focus_counts == -3);
}

}  // namespace plumbline::v4l2_zoom_test
