#include "drivers/camera/v4l2_controls.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>

#include "drivers/ioctl.h"

namespace plumbline::camera {
namespace {

/// A control and its unit. V4L2_CID_EXPOSURE_ABSOLUTE counts 0.1 ms and the colour temperature
/// kelvin; the other units depend on the camera.
struct Known {
  std::uint32_t id;
  std::string_view name;
  double per_count;
};

constexpr Known kExposure{V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_s", 1e-4};
constexpr Known kGain{V4L2_CID_GAIN, "gain_counts", 1};
constexpr Known kWhiteBalance{V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white_balance_K", 1};
constexpr Known kFocus{V4L2_CID_FOCUS_ABSOLUTE, "focus_counts", 1};
constexpr Known kZoom{V4L2_CID_ZOOM_ABSOLUTE, "zoom_counts", 1};
constexpr std::array<Known, 5> kListed = {kExposure, kGain, kWhiteBalance, kFocus, kZoom};

constexpr Known kAutoExposure{V4L2_CID_EXPOSURE_AUTO, "automatic exposure", 1};
constexpr Known kAutoGain{V4L2_CID_AUTOGAIN, "automatic gain", 1};
constexpr Known kAutoWhiteBalance{V4L2_CID_AUTO_WHITE_BALANCE, "automatic white balance", 1};
constexpr Known kAutoFocus{V4L2_CID_FOCUS_AUTO, "autofocus", 1};

/// Returns false if the device does not have the control.
bool Query(int fd, std::uint32_t id, v4l2_queryctrl& query) {
  query = {};
  query.id = id;
  return IoctlAgain(fd, VIDIOC_QUERYCTRL, &query) == 0 &&
         (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0;
}

bool Get(int fd, std::uint32_t id, int& value) {
  v4l2_control control{};
  control.id = id;
  if (IoctlAgain(fd, VIDIOC_G_CTRL, &control) != 0) return false;
  value = control.value;
  return true;
}

class Setter {
 public:
  explicit Setter(int fd) : fd_(fd) {}

  /// Switches an automatic off if the camera has it.
  void SwitchOff(const Known& known, int off) {
    v4l2_queryctrl query{};
    if (Query(fd_, known.id, query)) Set(known, query, off);
  }
  void SetValue(const Known& known, double value) {
    v4l2_queryctrl query{};
    if (!Query(fd_, known.id, query)) {
      remarks_.push_back(fmt::format("{}: not supported by this camera", known.name));
      return;
    }
    const double counts = std::round(value / known.per_count);
    if (!(counts >= query.minimum && counts <= query.maximum)) {
      remarks_.push_back(fmt::format(
          "{}: {:g} is outside the range {:g}..{:g} of this camera; left unchanged", known.name,
          value, query.minimum * known.per_count, query.maximum * known.per_count));
      return;
    }
    Set(known, query, static_cast<int>(counts));
  }
  std::vector<std::string> remarks() && { return std::move(remarks_); }

 private:
  void Set(const Known& known, const v4l2_queryctrl& query, int counts) {
    v4l2_control control{};
    control.id = known.id;
    control.value = counts;
    int actual = 0;
    if ((query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) {
      remarks_.push_back(fmt::format("{}: read-only on this camera", known.name));
    } else if (IoctlAgain(fd_, VIDIOC_S_CTRL, &control) != 0) {
      remarks_.push_back(fmt::format("{}: the camera rejects {:g}: {}", known.name,
                                     counts * known.per_count, std::strerror(errno)));
    } else if (Get(fd_, known.id, actual) && actual != counts) {
      remarks_.push_back(fmt::format("{}: requested {:g}, the camera set {:g}", known.name,
                                     counts * known.per_count, actual * known.per_count));
    }
  }

  const int fd_;
  std::vector<std::string> remarks_;
};

}  // namespace

std::vector<std::string> ApplySettings(int fd, const CameraSettings& settings) {
  Setter setter(fd);
  setter.SwitchOff(kAutoFocus, 0);
  if (settings.focus_counts) setter.SetValue(kFocus, *settings.focus_counts);
  if (settings.exposure_s) {
    setter.SwitchOff(kAutoExposure, V4L2_EXPOSURE_MANUAL);
    setter.SetValue(kExposure, *settings.exposure_s);
  }
  if (settings.gain_counts) {
    setter.SwitchOff(kAutoGain, 0);
    setter.SetValue(kGain, *settings.gain_counts);
  }
  if (settings.white_balance_K) {
    setter.SwitchOff(kAutoWhiteBalance, 0);
    setter.SetValue(kWhiteBalance, *settings.white_balance_K);
  }
  return std::move(setter).remarks();
}

std::vector<V4l2Control> ControlsOf(int fd) {
  std::vector<V4l2Control> controls;
  for (const Known& known : kListed) {
    v4l2_queryctrl query{};
    int value = 0;
    if (!Query(fd, known.id, query) || !Get(fd, known.id, value)) continue;
    controls.push_back({std::string(known.name), query.minimum * known.per_count,
                        query.maximum * known.per_count, query.default_value * known.per_count,
                        value * known.per_count});
  }
  return controls;
}

}  // namespace plumbline::camera
