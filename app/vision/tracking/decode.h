// Decoding of a tag from the cells of a quadrilateral.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "app/base/target/tag_family.h"
#include "app/vision/tracking/quads.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

// Bilinear interpolation of grey levels.

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

/// Homography that maps the unit square's corners (0,0), (1,0), (1,1), (0,1) to four points, no
/// three of which are collinear.
Mat3 MapOfUnitSquare(const Corners& corners);

/// Applies a homography to a point.
lens::Vec2 Mapped(const Mat3& map, const lens::Vec2& point);

/// Cells of a square that has a tag's border.
struct CellReading {
  std::uint64_t bits = 0;  ///< as TagFamily::codes
  double contrast = 0;     ///< bright minus dark [grey levels]
};

/// Reads the cells. The dark level is a plane fitted to the grey levels of the border's cells, the
/// bright level one fitted just outside of them; a cell's threshold is halfway between. At most one
/// in 14 border cells may be bright, and one in 6 of the surrounding samples dark. For a strict
/// family none may be, and each data cell must differ from its threshold by a fifth of the
/// contrast.
/// @param border        width of the border in cells
/// @param blurred       whether neighbouring cells are mixed by blur even if they are large
/// @param min_contrast  [grey levels]
/// @return              nullopt if the quadrilateral has no such border
std::optional<CellReading> ReadCells(const image::LumaView& image, const target::TagFamily& family,
                                     int border, const Corners& corners, bool blurred,
                                     double min_contrast);

}  // namespace plumbline::vision
