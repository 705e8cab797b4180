// V4L2 controls: exposure, gain, white balance and focus, each verified after setting.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace plumbline::camera {

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

}  // namespace plumbline::camera
