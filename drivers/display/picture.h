// A picture that was drawn, as pixels in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// Red, green, blue and a fourth byte without meaning; row by row from the top, no padding.
struct PictureView {
  const std::uint8_t* rgbx = nullptr;
  ImageSize size;

  const std::uint8_t* row(int v) const {
    return rgbx + static_cast<std::ptrdiff_t>(v) * size.width * 4;
  }
};

/// For files: red, green, blue; row by row from the top, no padding.
struct RgbImage {
  std::vector<std::uint8_t> rgb;
  ImageSize size;
};

}  // namespace plumbline
