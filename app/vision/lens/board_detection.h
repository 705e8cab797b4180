// Detection of a calibration board of any kind in one frame.
#pragma once

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Locates the board's points to a few hundredths of a pixel, in a time that is bounded for any
/// image content. The whole board must be in the image, except for ChArUco, where a part is enough.
/// The points are in the order of the printed board if tags or a mark show it; otherwise
/// the first one is that nearest to the top left of those that can be the first.
/// @param board  valid: FaultOf(board) is nullopt
/// @return       the view without its name and time, or the reason why there is none, worded for
///               the operator
Result<BoardView> DetectBoard(const image::LumaView& image, const target::Board& board);

}  // namespace plumbline::vision
