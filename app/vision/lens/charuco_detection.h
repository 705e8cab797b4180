// Detection of a complete or partly visible ChArUco board in one frame.
#pragma once

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Decodes the board's tags, predicts the adjacent corners by each tag's own homography, and
/// refines those whose four squares have the expected colours. A part of the board is enough,
/// because the tags identify it. Tags are numbered row by row over the white squares from the top
/// left. The top left square is black, or white on OpenCV's older boards with an even number of
/// rows; both layouts are tried. Run time is bounded as for tag detection.
/// @return  the view without its name and time, or why there is none: "no tag of aruco-6x6-250",
///          tags not arranged as on this board, too few corners
Result<BoardView> DetectCharuco(const image::LumaView& image, const target::Board& board);

}  // namespace plumbline::vision
