// Non-owning view of a grey image.
#pragma once

#include <cstddef>
#include <cstdint>

#include "firmware-like/image/image_size.h"

namespace plumbline::image {

/// 8-bit luma, stored row by row; pixel (0, 0) is the top-left one. Valid as long as the owner's
/// buffer exists.
struct LumaView {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next, >= width

  const std::uint8_t* row(int v) const { return data + v * stride; }
  ImageSize size() const { return {width, height}; }
};

}  // namespace plumbline::image
