// Detection of a complete chessboard in one frame.
#pragma once

#include <optional>
#include <utility>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Finds saddle points at a width of about 960 px, links them into lattices, and refines the
/// lattice with the board's number of corners at full resolution. Run time is bounded by the number
/// of pixels and a limit on the saddle points considered. Of the two (or four) possible first
/// corners, the one nearest to the top left is chosen.
/// @return  the view without its name and time, or why there is none: "no chessboard", "a board of
///          9 x 6 inner corners instead of 17 x 11", "only a part of the board: ..."
Result<BoardView> DetectChessboard(const image::LumaView& image, const target::Board& board);

/// Size of any complete chessboard in the image, in inner corners, larger number first. Used to
/// suggest the right size when no image shows the requested board.
/// @return  nullopt if there is none
std::optional<std::pair<int, int>> WholeChessboardIn(const image::LumaView& image);

}  // namespace plumbline::vision
