#include "drivers/display/picture.h"

#include <algorithm>

namespace plumbline::display {

RgbImage Cropped(const RgbImage& picture, int x, int y, image::ImageSize size) {
  const int left = std::clamp(x, 0, picture.size.width);
  const int top = std::clamp(y, 0, picture.size.height);
  RgbImage part;
  part.size = {std::clamp(size.width, 0, picture.size.width - left),
               std::clamp(size.height, 0, picture.size.height - top)};
  for (int v = top; v < top + part.size.height; ++v) {
    const auto* const row =
        picture.rgb.data() + std::ptrdiff_t{3} * (std::ptrdiff_t{v} * picture.size.width + left);
    part.rgb.insert(part.rgb.end(), row, row + std::ptrdiff_t{3} * part.size.width);
  }
  return part;
}

}  // namespace plumbline::display
