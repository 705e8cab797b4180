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

  virtual ImageSize size() const = 0;  ///< {0, 0}: none was drawn

  /// Some of its rows, as a picture that has no others; valid until the next call. Waits until it
  /// is finished.
  virtual PictureView ReadRows(int first, int count) = 0;
};

/// Reads it in parts, each small enough to stay in the processor's cache until it is taken, and
/// needs memory for one part only. @param take  (int first_row, const PictureView& rows)
template <typename Take>
void ReadInParts(DrawnPicture& picture, Take take) {
  constexpr int kParts = 8;
  const int height = picture.size().height, most = (height + kParts - 1) / kParts;
  for (int first = 0; first < height; first += most) {
    take(first, picture.ReadRows(first, first + most < height ? most : height - first));
  }
}

/// For files: red, green, blue; row by row from the top, no padding.
struct RgbImage {
  std::vector<std::uint8_t> rgb;
  ImageSize size;
};

}  // namespace plumbline
