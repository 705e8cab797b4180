#include "drivers/camera/v4l2_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/ioctl.h"
#include "drivers/os/descriptor.h"

namespace plumbline::camera {
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
