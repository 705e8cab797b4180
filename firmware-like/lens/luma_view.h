// A grey image that somebody else owns.
#pragma once

#include <cstddef>
#include <cstdint>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// 8-bit luma, row by row. Pixel (0, 0) is the top-left one. Valid as long as its owner says.
struct LumaView {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next, >= width

  const std::uint8_t* row(int v) const { return data + v * stride; }
  ImageSize size() const { return {width, height}; }
};

}  // namespace plumbline
