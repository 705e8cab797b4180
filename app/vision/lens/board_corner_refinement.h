// Sub-pixel refinement of board corners.
#pragma once

#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/luma_view.h"

namespace plumbline::vision {

/// Local lattice vectors at a corner, to its neighbours along a row and down a column [px].
struct LatticeSteps {
  lens::Vec2 along_row = lens::Vec2::Zero(), down_column = lens::Vec2::Zero();
};

/// Moves each corner to the intersection of the edges through it. The first step is the point c to
/// which all nearby gradients g are perpendicular [W. Foerstner and E. Guelch, ISPRS 1987]:
///   sum_q w(q) g(q) g(q)^T (c - q) = 0,   w = 1 / (|c - q|^2 + (8 px)^2)
/// summed over the parallelogram of the four squares' inner halves and iterated; the weight
/// accounts for an error that grows with distance. The second step is the intersection of two lines
/// fitted to the edges. Uneven brightness is removed first (BoardShading). The image is smoothed by
/// a Gaussian of 2 px first, which leaves straight edges in place and suppresses pixel noise. If
/// the squares carry tags (ChArUco), only a cross along the edges is used: pixels within the tags'
/// free margin on either side of an edge, less the reach of the smoothing.
/// @param steps  of each corner
/// @param rim    smallest distance of a tag from an edge, as a share of a step; 1/2 or more if
///               there are no tags
/// @param view   on input, corners_px within about a sixth of a step; refined in place. `seen` is
///               cleared where no corner is found; blur_px is set.
void RefineCorners(const image::LumaView& image, const std::vector<LatticeSteps>& steps,
                   BoardView& view, double rim = 0.5);

}  // namespace plumbline::vision
