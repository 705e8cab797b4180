// Bilinear interpolation of grey levels.
#pragma once

#include <algorithm>

#include "firmware-like/image/luma_view.h"

namespace plumbline::vision {

/// Grey level at (u, v); positions outside the image are clamped to its border.
inline double GreyAt(const image::LumaView& image, double u, double v) {
  u = std::clamp(u, 0.0, static_cast<double>(image.width - 1));
  v = std::clamp(v, 0.0, static_cast<double>(image.height - 1));
  const int i = std::min(static_cast<int>(u), image.width - 2);
  const int j = std::min(static_cast<int>(v), image.height - 2);
  const double a = u - i, b = v - j;
  const std::uint8_t* upper = image.row(j) + i;
  const std::uint8_t* lower = image.row(j + 1) + i;
  return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

}  // namespace plumbline::vision
