// A grid of circles in one frame.
#pragma once

#include "app/lens/board.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Finds the whole grid of dark discs on white: what is darker than its surroundings and has the
/// moments of an ellipse at a size of about 960 px, linked into lattices, the one with the board's
/// pattern refined at full size. The work is bounded by the pixels and the number of discs taken
/// up. The first disc is that of the possible ones (two or four; an asymmetric grid of an odd
/// number of rows has one) that lies nearest to the top left. The points are the centres of the
/// ellipses in the image, which are not quite the images of the discs' centres: see DiscOffsets.
/// @return  the view without name and time, or why there is none: "no grid of circles", "only a
///          part of the board: ..."
Result<BoardView> DetectCircles(const LumaView& image, const Board& board);

}  // namespace plumbline
