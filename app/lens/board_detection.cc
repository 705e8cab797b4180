#include "app/lens/board_detection.h"

#include "app/lens/charuco_detection.h"
#include "app/lens/chessboard_detection.h"
#include "app/lens/circle_detection.h"

namespace plumbline::lens {

Result<BoardView> DetectBoard(const image::LumaView& image, const Board& board) {
  switch (board.kind) {
    case BoardKind::kChessboard:
      return DetectChessboard(image, board);
    case BoardKind::kCharuco:
      return DetectCharuco(image, board);
    case BoardKind::kCircles:
    case BoardKind::kAsymmetricCircles:
      return DetectCircles(image, board);
  }
  return Error{"unknown kind of board"};
}

}  // namespace plumbline::lens
