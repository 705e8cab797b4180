// Detection of the calibration board in the images of a folder.
#pragma once

#include <string>
#include <vector>

#include "app/cli/progress.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::cli {

struct BoardFrames {
  std::vector<vision::BoardView> views;
  std::vector<vision::RefusedFrame> refused;
  image::ImageSize size;
  std::string size_conflict;  ///< no size is the most frequent one; empty: none
};

/// Detects the board in every image. Images whose size differs from the most frequent one are
/// refused.
/// @param names  of the images in the folder
BoardFrames DetectBoards(const std::string& folder, const std::vector<std::string>& names,
                         const target::Board& board, Progress& progress);

/// Hint if most images show a complete chessboard of another size than requested; else empty.
std::string OtherBoardHint(const std::string& folder, const std::vector<std::string>& names,
                           const target::Board& board);

}  // namespace plumbline::cli
