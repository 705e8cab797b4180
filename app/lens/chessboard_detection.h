// The chessboard in one frame.
#pragma once

#include <optional>
#include <utility>

#include "app/lens/board.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Finds the whole board: saddle points at a size of about 960 px, linked into lattices, the one
/// with the board's number of corners refined at full size. The work is bounded by the number of
/// pixels and of saddle points taken up, so that no frame takes long.
/// The first corner is that of the two (or four) possible ones that lies nearest to the top left.
/// @return  the view without name and time, or why there is none: "no chessboard", "a board of
///          9 x 6 inner corners instead of 17 x 11", "only a part of the board: ..."
Result<BoardView> DetectChessboard(const LumaView& image, const Board& board);

/// Columns and rows of the inner corners of a whole chessboard of whatever size, the larger number
/// first: what to tell where no image shows the board that was asked for. Nothing where none hangs
/// together.
std::optional<std::pair<int, int>> WholeChessboardIn(const LumaView& image);

}  // namespace plumbline
