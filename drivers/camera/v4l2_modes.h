// Capture modes of a V4L2 camera and the choice among them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/pixel_format.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// One format at one size or a range of sizes.
struct V4l2Mode {
  std::uint32_t fourcc = 0;
  image::ImageSize smallest = {}, largest = {};  ///< equal for a single size; {0, 0} for DV
  image::ImageSize step = {1, 1};                ///< increment within the range
  std::vector<double> rates_hz = {};  ///< at the largest size, fastest first; empty: not reported
};

struct ModeRequest {
  image::ImageSize size = {};  ///< {0, 0}: the largest that reaches rate_hz
  double rate_hz = 20;         ///< minimum, if the camera supports it
  std::vector<PixelFormat> formats =
      {}  ///< acceptable formats, best first; empty: all in order of preference
  ;
};

struct ModeChoice {
  PixelFormat format = PixelFormat::kGrey;
  image::ImageSize size;  ///< of DV: {0, 0}, stated by its frames
  double rate_hz = 0;     ///< rate to request; 0: none
};

/// All modes of an open device, including formats that are not supported here.
std::vector<V4l2Mode> ModesOf(int fd);

/// Chooses the most preferred format that reaches the rate at the requested size; if none does, the
/// fastest mode of that size. Without a requested size, chooses the largest size that reaches the
/// rate. DV is chosen only if the device has no other supported format, whatever size and rate are
/// requested: DV has one size and rate, which each frame states. Pure.
/// @return the choice, or an error that lists what the device offers
Result<ModeChoice> ChooseMode(const std::vector<V4l2Mode>& modes, const ModeRequest& request);

/// "YUYV 1920x1080@30".
std::string ModeText(PixelFormat format, image::ImageSize size, double rate_hz);

}  // namespace plumbline::camera
