// Rendered pictures as pixels in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::display {

/// Red, green, blue and an unused fourth byte; row by row from the top, no padding.
struct PictureView {
  const std::uint8_t* rgbx = nullptr;
  image::ImageSize size;

  const std::uint8_t* row(int v) const {
    return rgbx + static_cast<std::ptrdiff_t>(v) * size.width * 4;
  }
};

/// A rendered picture, whose pixels a display reads from the renderer on demand.
class DrawnPicture {
 public:
  DrawnPicture() = default;
  DrawnPicture(const DrawnPicture&) = delete;
  DrawnPicture& operator=(const DrawnPicture&) = delete;
  virtual ~DrawnPicture() = default;

  virtual image::ImageSize size() const = 0;  ///< {0, 0}: nothing was drawn yet

  /// Reads `count` rows starting at `first`; valid until the next call. Waits until rendering is
  /// complete.
  virtual PictureView ReadRows(int first, int count) = 0;
};

/// Reads a picture in strips that are small enough to stay in the CPU cache until they are
/// consumed.
/// @param take  callable (int first_row, const PictureView& rows)
template <typename Take>
void ReadInStrips(DrawnPicture& picture, Take take) {
  constexpr int kStrips = 8;
  const int height = picture.size().height, rows = (height + kStrips - 1) / kStrips;
  for (int first = 0; first < height; first += rows) {
    take(first, picture.ReadRows(first, first + rows < height ? rows : height - first));
  }
}

/// Image for files: red, green, blue; row by row from the top, no padding.
struct RgbImage {
  std::vector<std::uint8_t> rgb;
  image::ImageSize size;
};

/// The part of a picture; clamped to it.
RgbImage Cropped(const RgbImage& picture, int x, int y, image::ImageSize size);

}  // namespace plumbline::display
