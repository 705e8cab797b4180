#include "app/vision/lens/board_detection.h"

#include "app/vision/lens/charuco_detection.h"
#include "app/vision/lens/chessboard_detection.h"
#include "app/vision/lens/circle_detection.h"

namespace plumbline::vision {

Result<BoardView> DetectBoard(const image::LumaView& image, const target::Board& board) {
  switch (board.kind) {
    case target::BoardKind::kChessboard:
      return DetectChessboard(image, board);
    case target::BoardKind::kCharuco:
      return DetectCharuco(image, board);
    case target::BoardKind::kCircles:
    case target::BoardKind::kAsymmetricCircles:
      return DetectCircles(image, board);
  }
  return Error{"unknown kind of board"};
}

}  // namespace plumbline::vision
