// Corners of a board to a few hundredths of a pixel.
#pragma once

#include <vector>

#include "app/lens/board.h"
#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// The board's steps at one corner, to its neighbours along a row and down a column [px].
struct LatticeSteps {
  Vec2 along_row = Vec2::Zero(), down_column = Vec2::Zero();
};

/// Moves each corner to where the edges through it meet: the point that every gradient near it is
/// perpendicular to,
///   sum_q w(q) g(q) g(q)^T (c - q) = 0,   w = 1 / (|c - q|^2 + (8 px)^2)
/// over the parallelogram of the four squares' inner halves; w is the weight of an error that grows
/// with the distance
/// [W. Foerstner and E. Guelch, ISPRS 1987], repeated about the new place until it stands. The
/// image is smoothed by a Gaussian of 2 px before, which costs nothing in accuracy (straight edges
/// stay where they are) and takes the pixel noise away.
/// Where the squares carry tags (ChArUco), only the cross along the edges counts: the pixels that
/// are within the tags' free rim of either edge, less what smoothing carries in.
/// @param steps  of each corner
/// @param rim    least distance of a tag from an edge, share of a step; 1/2 and more: no tags
/// @param view   corners_px within about a sixth of a step, changed in place; `seen` becomes false
///               where no corner is found; blur_px is set
void RefineCorners(const LumaView& image, const std::vector<LatticeSteps>& steps, BoardView& view,
                   double rim = 0.5);

}  // namespace plumbline
