// What a camera can send, and what of it is asked for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/pixel_format.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline {

/// One format at one size, or at a range of sizes.
struct V4l2Mode {
  std::uint32_t fourcc = 0;
  ImageSize smallest, largest;   ///< equal where the size is one
  ImageSize step = {1, 1};       ///< of a range
  std::vector<double> rates_hz;  ///< fastest first, at the largest size; empty: not told
};

struct ModeRequest {
  ImageSize size = {};                   ///< {0, 0}: the largest that is fast enough
  double rate_hz = 20;                   ///< at least, where the camera can
  std::vector<PixelFormat> formats = {}  ///< those wanted, best first; empty: all, by their order
  ;
};

struct ModeChoice {
  PixelFormat format = PixelFormat::kGrey;
  ImageSize size;
  double rate_hz = 0;  ///< to ask for; 0: the camera tells none
};

/// All modes of an open device, readable by us or not.
std::vector<V4l2Mode> ModesOf(int fd);

/// The first wanted format that has the size at the rate; else what comes nearest to the rate.
/// Where no size is asked for, the largest at the rate. Pure.
/// @return or what the device has instead
Result<ModeChoice> ChooseMode(const std::vector<V4l2Mode>& modes, const ModeRequest& request);

/// "YUYV 1920x1080@30".
std::string ModeText(PixelFormat format, ImageSize size, double rate_hz);

}  // namespace plumbline
