// Alignment of a rough quadrilateral with the edges in the full image, to a third of a pixel.
#pragma once

#include "app/vision/tracking/quads.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

struct EdgeSearch {
  double reach_px = 4;     ///< search range on either side of the rough side
  double min_step = 5;     ///< smallest dark-to-bright step [grey levels]
  double min_share = 0.7;  ///< share of the positions along a side that must show such a step
};

/// Moves the sides onto the steps from dark inside to bright outside: finds the steepest point of
/// up to 24 profiles across each side, fits a straight line to these points without outliers, and
/// intersects the four lines.
/// @return  true if all four sides follow an edge; otherwise the quadrilateral is not a tag
bool SnapToEdges(const image::LumaView& image, const EdgeSearch& search, Corners& corners);

}  // namespace plumbline::vision
