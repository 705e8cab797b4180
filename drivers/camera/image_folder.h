// Grey images and folders of image files.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Most pixels of an image file; more are refused before they are decoded.
inline constexpr std::size_t kMaxFilePixels = 100'000'000;

/// A grey image in memory.
struct GreyImage {
  std::vector<std::uint8_t> grey;  ///< row by row, no padding
  int width = 0, height = 0;

  image::LumaView View() const { return {grey.data(), width, height, width}; }
};

/// Names of the image files in a folder, selected by extension, in natural order: frame2 before
/// frame10.
Result<std::vector<std::string>> ListImageNames(const std::string& folder);

}  // namespace plumbline::camera
