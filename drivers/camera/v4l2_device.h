// Which cameras this machine has, and which of them is meant.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

/// Where the kernel shows its video devices; other places in tests.
struct DeviceTree {
  std::string sysfs = "/sys/class/video4linux";
  std::string dev = "/dev";
};

/// Of a device whose images come in several planes (V4L2_CAP_VIDEO_CAPTURE_MPLANE).
inline constexpr const char* kMultiPlanar =
    "gives its images in several planes (multi-planar), which is not read: a USB camera, or this "
    "board's driver in its single-planar mode, is";

/// A device node that captures images.
struct V4l2Device {
  std::string path;     ///< "/dev/video0": changes from boot to boot
  std::string name;     ///< what the driver calls it
  std::string driver;   ///< "uvcvideo"; empty where it cannot be opened
  std::string serial;   ///< of the camera; empty: it has none
  std::string model;    ///< "046d:0825" of a USB camera, else the driver's name
  std::string port;     ///< where it is plugged in: USB "1-2.3", else the bus
  std::string problem;  ///< why it cannot be used, and what to do; else empty
};

/// Capture devices by the number of their node, those that cannot be used with their problem. A
/// camera with several nodes of images has several.
std::vector<V4l2Device> ListV4l2Devices(const DeviceTree& tree = {});

/// "SERIAL@1-2.3"; "046d:0825@1-2.3", by its model, where it has no serial number.
std::string NameWithPort(const V4l2Device& device);

/// What names this camera for ever: its serial number, or NameWithPort() where it has none or `all`
/// has another camera of the same number.
std::string LastingName(const V4l2Device& device, const std::vector<V4l2Device>& all);

/// The device that `selector` means: a path ("/dev/video0", a link of /dev/v4l), a serial number, a
/// serial number or model with "@" and a port, or "@" and a port alone. Of several nodes of one
/// camera the first that can be used. A path that the list does not have is asked itself.
/// @return or why none is meant: unknown, or two cameras of one serial number
Result<V4l2Device> SelectV4l2Device(std::string_view selector,
                                    const std::vector<V4l2Device>& devices);

}  // namespace plumbline
