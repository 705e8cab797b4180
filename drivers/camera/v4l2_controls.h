// Exposure, gain, white balance and focus: set, read back, told where the camera does otherwise.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace plumbline {

/// What stays as it is told here; whatever is absent is left alone. What is set is taken from its
/// automatic. Autofocus is switched off always: a lens that focuses by itself is another lens.
struct CameraSettings {
  std::optional<double> exposure_s = {};
  std::optional<int> gain_counts = {};
  std::optional<double> white_balance_K = {};
  std::optional<int> focus_counts = {};
};

/// A control of the camera's that matters here.
struct V4l2Control {
  std::string
      name;  ///< "exposure_s", "gain_counts", "white_balance_K", "focus_counts", "zoom_counts"
  double smallest = 0, largest = 0, standard = 0, value = 0;
};

/// Sets the controls of an open device and reads each back.
/// @return what was refused, is missing, or came out otherwise: one sentence each
std::vector<std::string> ApplySettings(int fd, const CameraSettings& settings);

/// Those that the device has, with their ranges.
std::vector<V4l2Control> ControlsOf(int fd);

}  // namespace plumbline
