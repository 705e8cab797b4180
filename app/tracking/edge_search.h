// From a rough quadrilateral to the edges in the full image, to a third of a pixel.
#pragma once

#include "app/tracking/quads.h"
#include "firmware-like/lens/luma_view.h"

namespace plumbline {

struct EdgeSearch {
  double reach_px = 4;       ///< how far from the rough side an edge is looked for
  double least_step = 5;     ///< a step from dark (inside) to bright that counts [grey levels]
  double least_share = 0.7;  ///< of the places along a side where there is such a step
};

/// Moves the sides onto the steps from dark inside to bright outside: along each side up to 24
/// profiles across it, the steepest place of each, a straight line through them with those far
/// off left out, and the corners where the lines meet.
/// @return  true where all four sides follow an edge; else the quadrilateral is none of a tag
bool SnapToEdges(const LumaView& image, const EdgeSearch& search, Corners& corners);

}  // namespace plumbline
