#include "drivers/camera/v4l2_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/ioctl.h"
#include "drivers/os/descriptor.h"

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

Result<V4l2Capabilities> QueryV4l2Capabilities(const V4l2Device& device) {
  const os::Descriptor fd(open(device.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return Error{files::OpenErrorText(errno, files::kCameraDevice)};
  return V4l2Capabilities{ModesOf(fd.get()), ControlsOf(fd.get())};
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxTextBytes = 200;

/// First line of a sysfs file, printable characters only.
std::string LineOf(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::erase_if(line, [](char c) { return c < ' ' || c > '~'; });
  line.resize(std::min(line.find_last_not_of(' ') + 1, kMaxTextBytes));
  return line;
}

/// 10 for "video10"; nullopt for other nodes such as "vbi0".
std::optional<int> NodeNumber(std::string_view node) {
  constexpr std::string_view kPrefix = "video";
  if (!node.starts_with(kPrefix)) return std::nullopt;
  node.remove_prefix(kPrefix.size());
  int number = 0;
  const auto [end, error] = std::from_chars(node.data(), node.data() + node.size(), number);
  if (error != std::errc() || end != node.data() + node.size()) return std::nullopt;
  return number;
}

/// Text in a fixed-size field that may lack a terminating zero.
template <std::size_t kSize>
std::string TextOf(const unsigned char (&field)[kSize]) {
  const auto* end = std::find(field, field + kSize, '\0');
  return {field, end};
}

/// Queries the device. @return whether it captures images; nullopt if it cannot be queried
std::optional<bool> QueryDevice(V4l2Device& device) {
  const os::Descriptor fd(open(device.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  v4l2_capability capability{};
  if (!fd || IoctlAgain(fd.get(), VIDIOC_QUERYCAP, &capability) != 0) {
    device.problem = files::OpenErrorText(errno, files::kCameraDevice);
    return std::nullopt;
  }
  device.name = TextOf(capability.card);
  device.driver = TextOf(capability.driver);
  if (device.port.empty()) device.port = TextOf(capability.bus_info);
  if (device.model.empty()) device.model = device.driver;
  const std::uint32_t caps = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? capability.device_caps
                                 : capability.capabilities;
  if ((caps & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) ==
      V4L2_CAP_VIDEO_CAPTURE_MPLANE) {
    device.problem = kMultiPlanar;
    return true;
  }
  return (caps & V4L2_CAP_VIDEO_CAPTURE) != 0;
}

/// Reads serial number, model and port of the USB device that the sysfs `node` belongs to.
void ReadUsbAttributes(const fs::path& node, V4l2Device& device) {
  std::error_code why;
  fs::path at = fs::canonical(node / "device", why);
  for (; !why && at.has_relative_path(); at = at.parent_path()) {
    if (!fs::exists(at / "idVendor", why)) continue;
    device.serial = LineOf(at / "serial");
    device.model = LineOf(at / "idVendor") + ":" + LineOf(at / "idProduct");
    device.port = at.filename();
    return;
  }
}

bool IsSameCamera(const V4l2Device& a, const V4l2Device& b) {
  return a.port == b.port && a.model == b.model && a.serial == b.serial;
}

}  // namespace

std::string NameWithPort(const V4l2Device& device) {
  return (device.serial.empty() ? device.model : device.serial) + "@" + device.port;
}

std::vector<V4l2Device> ListVideoNodes(const DeviceTree& tree) {
  std::vector<std::pair<int, V4l2Device>> found;
  std::error_code why;
  fs::directory_iterator at(tree.sysfs, why);
  for (; !why && at != fs::directory_iterator(); at.increment(why)) {
    const std::string node = at->path().filename();
    const std::optional<int> number = NodeNumber(node);
    if (!number) continue;
    V4l2Device device;
    device.path = fs::path(tree.dev) / node;
    device.name = LineOf(at->path() / "name");
    ReadUsbAttributes(at->path(), device);
    found.emplace_back(*number, std::move(device));
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<V4l2Device> devices;
  devices.reserve(found.size());
  for (auto& [number, device] : found) devices.push_back(std::move(device));
  return devices;
}

std::vector<V4l2Device> ListV4l2Devices(const DeviceTree& tree) {
  std::vector<V4l2Device> devices = ListVideoNodes(tree);
  std::erase_if(devices, [](V4l2Device& device) { return !QueryDevice(device).value_or(true); });
  return devices;
}

std::string StableName(const V4l2Device& device, const std::vector<V4l2Device>& all) {
  const bool is_shared = std::any_of(all.begin(), all.end(), [&](const V4l2Device& other) {
    return other.serial == device.serial && !IsSameCamera(other, device);
  });
  return device.serial.empty() || is_shared ? NameWithPort(device) : device.serial;
}

Result<V4l2Device> SelectV4l2Device(std::string_view selector,
                                    const std::vector<V4l2Device>& devices) {
  if (selector.starts_with('/')) {
    std::error_code why;
    const fs::path meant = fs::weakly_canonical(selector, why);
    for (const V4l2Device& device : devices) {
      if (!why && meant == fs::weakly_canonical(device.path, why)) return device;
    }
    V4l2Device unlisted;
    unlisted.path = selector;
    QueryDevice(unlisted);
    return unlisted;
  }
  std::vector<V4l2Device> meant;
  for (const V4l2Device& device : devices) {
    const bool fits = (selector == device.serial && !device.serial.empty()) ||
                      selector == NameWithPort(device) || selector == "@" + device.port;
    if (!fits) continue;
    const auto same = std::find_if(meant.begin(), meant.end(),
                                   [&](const auto& one) { return IsSameCamera(one, device); });
    if (same == meant.end()) {
      meant.push_back(device);
    } else if (!same->problem.empty() && device.problem.empty()) {
      *same = device;
    }
  }
  if (meant.empty()) {
    return Error{fmt::format(
        "no camera {} found. Check that it is plugged in; plumbline cameras lists all cameras.",
        selector)};
  }
  if (meant.size() > 1) {
    return Error{
        fmt::format("{} cameras have the serial number {}. Add the port to select one: {} or {}",
                    meant.size(), selector, NameWithPort(meant[0]), NameWithPort(meant[1]))};
  }
  return meant.front();
}

}  // namespace plumbline::camera
