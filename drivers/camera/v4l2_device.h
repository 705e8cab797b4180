// Enumeration and selection of V4L2 capture devices.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/v4l2_modes.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

// V4L2 controls: exposure, gain, white balance and focus, each verified after setting.

/// Settings to apply; absent ones are left unchanged. The automatic mode of every setting that is
/// applied is switched off. Autofocus is always switched off, because focusing changes the lens
/// model.
struct CameraSettings {
  std::optional<double> exposure_s = {};
  std::optional<int> gain_counts = {};
  std::optional<double> white_balance_K = {};
  std::optional<int> focus_counts = {};
};

/// A control of the camera with its range.
struct V4l2Control {
  /// "exposure_s", "gain_counts", "white_balance_K", "focus_counts" or "zoom_counts".
  std::string name;
  double smallest = 0, largest = 0, standard = 0, value = 0;
};

/// Sets the controls of an open device and reads each back.
/// @return one sentence for each control that was rejected, is missing, or has another value
std::vector<std::string> ApplySettings(int fd, const CameraSettings& settings);

/// Controls of the device with their ranges.
std::vector<V4l2Control> ControlsOf(int fd);

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

// Capabilities of a camera: its modes and controls.

struct V4l2Capabilities {
  std::vector<V4l2Mode> modes;
  std::vector<V4l2Control> controls;
};

/// Queries the device. Opens it briefly; does not disturb another program that is streaming from
/// it.
Result<V4l2Capabilities> QueryV4l2Capabilities(const V4l2Device& device);

}  // namespace plumbline::camera
