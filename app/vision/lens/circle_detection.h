// Detection of a complete grid of circles in one frame.
#pragma once

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Finds dark discs on white at a width of about 960 px (regions darker than their surroundings
/// with the moments of an ellipse), links them into lattices, and refines the lattice with the
/// board's pattern at full resolution. Run time is bounded by the number of pixels and a limit on
/// the discs considered. Of the possible first discs (two or four; one on an asymmetric grid with
/// an odd number of rows), the one nearest to the top left is chosen. The points are the centres of
/// the ellipses in the image, which differ slightly from the images of the discs' centres: see
/// DiscOffsets.
/// @return  the view without its name and time, or why there is none: "no grid of circles", "only a
///          part of the board: ..."
Result<BoardView> DetectCircles(const image::LumaView& image, const target::Board& board);

}  // namespace plumbline::vision
