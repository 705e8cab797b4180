// What the cells of a quadrilateral say.
#pragma once

#include <optional>

#include "app/tracking/quads.h"
#include "app/tracking/tag_family.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// The projective map that takes the corners (0,0), (1,0), (1,1), (0,1) of the unit square to four
/// points, none three of them on a line.
Mat3 MapOfUnitSquare(const Corners& corners);

/// Where a projective map takes a point.
Vec2 Mapped(const Mat3& map, const Vec2& point);

/// A tag read from the cells of a quadrilateral.
struct ReadTag {
  TagCode code;
  double contrast = 0;  ///< bright less dark [grey levels]
};

/// Reads the cells: dark is a plane through the grey levels of the border's cells, bright one
/// through those half a cell outside of it, the threshold of a cell the middle of the two. Of the
/// border's cells at most one in 14 may be bright, and of the places around it one in 6 dark.
/// @param least_contrast  [grey levels]
std::optional<ReadTag> ReadCells(const LumaView& image, const TagFamily& family,
                                 const Corners& corners, double least_contrast);

}  // namespace plumbline
