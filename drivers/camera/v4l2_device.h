// Enumeration and selection of V4L2 capture devices.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::camera {

/// Root directories of the kernel's video devices; replaced in tests.
struct DeviceTree {
  std::string sysfs = "/sys/class/video4linux";
  std::string dev = "/dev";
};

/// Problem text of a multi-planar device (V4L2_CAP_VIDEO_CAPTURE_MPLANE).
inline constexpr const char* kMultiPlanar =
    "delivers multi-planar images, which are not supported. Use a USB camera, or this board's "
    "driver in its single-planar mode.";

/// A device node that captures images.
struct V4l2Device {
  std::string path;     ///< "/dev/video0"; may change at every boot
  std::string name;     ///< name reported by the driver
  std::string driver;   ///< "uvcvideo"; empty if the node cannot be opened
  std::string serial;   ///< serial number of the camera; empty: none
  std::string model;    ///< "046d:0825" for a USB camera, otherwise the driver's name
  std::string port;     ///< USB port "1-2.3", otherwise the bus
  std::string problem;  ///< why it cannot be used, and the remedy; empty if usable
};

/// All video nodes that sysfs lists, in the order of their numbers, without opening them: for
/// processes that may not open cameras. `driver` and `problem` are empty, and without a USB port
/// `model` and `port` too; some nodes may not capture images.
std::vector<V4l2Device> ListVideoNodes(const DeviceTree& tree = {});

/// All capture devices in the order of their node numbers, unusable ones with their problem. A
/// camera may have several capture nodes.
std::vector<V4l2Device> ListV4l2Devices(const DeviceTree& tree = {});

/// "SERIAL@1-2.3", or "046d:0825@1-2.3" with the model if it has no serial number.
std::string NameWithPort(const V4l2Device& device);

/// Name of the camera that is stable across reboots: its serial number, or NameWithPort() if it has
/// none or another camera in `all` has the same one.
std::string StableName(const V4l2Device& device, const std::vector<V4l2Device>& all);

/// Finds the device that `selector` names: a path ("/dev/video0", a link in /dev/v4l), a serial
/// number, a serial number or model followed by "@" and a port, or "@" and a port alone. If a
/// camera has several nodes, the first usable one is returned. A path that is not in the list is
/// queried.
/// @return the device, or an error if none matches or two cameras have the same serial number
Result<V4l2Device> SelectV4l2Device(std::string_view selector,
                                    const std::vector<V4l2Device>& devices);

}  // namespace plumbline::camera
