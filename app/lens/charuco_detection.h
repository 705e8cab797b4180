// The ChArUco board, or a part of it, in one frame.
#pragma once

#include "app/lens/board.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Reads the board's tags, places the corners beside them by the tags' own homographies, and
/// refines those whose four squares have the right colours. A part of the board is enough: the
/// tags tell which one. Tags count row by row from the top left over the white squares; a board
/// begins with a black square at the top left, or with a white one (OpenCV's older boards with an
/// even number of rows): both are tried.
/// The work is bounded as the tags' detection is.
/// @return  the view without name and time, or why there is none: "no tag of aruco-6x6-250", tags
///          that do not lie as on this board, too few corners
Result<BoardView> DetectCharuco(const LumaView& image, const Board& board);

}  // namespace plumbline
