// The board in one frame, of whichever kind it is, within a bounded time whatever the frame shows.
#pragma once

#include "app/lens/board.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Finds the board's points to a few hundredths of a pixel. The whole board must be in the image,
/// except of ChArUco, of which a part is enough.
/// @param board  valid: FaultOf(board) is nothing
/// @return       the view without name and time, or why there is none, in words for an operator
Result<BoardView> DetectBoard(const LumaView& image, const Board& board);

}  // namespace plumbline
