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

/// A picture that was drawn, for a display to take.
class DrawnPicture {
 public:
  DrawnPicture() = default;
  DrawnPicture(const DrawnPicture&) = delete;
  DrawnPicture& operator=(const DrawnPicture&) = delete;
  virtual ~DrawnPicture() = default;

  /// Its pixels; valid until the next call. Waits until it is finished. Empty: none was drawn.
  virtual PictureView ReadPixels() = 0;
};

/// For files: red, green, blue; row by row from the top, no padding.
struct RgbImage {
  std::vector<std::uint8_t> rgb;
  ImageSize size;
};

}  // namespace plumbline
