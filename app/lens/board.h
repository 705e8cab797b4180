// The flat target that a lens is calibrated with.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// What is printed on the board.
enum class BoardKind {
  kChessboard,         ///< points are the inner corners: 18 x 12 squares have 17 x 11 of them
  kCharuco,            ///< likewise, with a tag in each white square that tells which one it is
  kCircles,            ///< points are the centres of dark discs, in straight columns
  kAsymmetricCircles,  ///< likewise, every other row shifted by half a step
};

/// A board, told by its points.
/// Frame K: origin at the first point, x along a row, y down the rows, z into the board; the camera
/// looks along +z when the board is upright in front of it. ChArUco is upright as its tags are.
struct Board {
  int columns = 17, rows = 11;  ///< of points
  double square_m = 0.010;      ///< side of a square; of circles, from one row to the next
  BoardKind kind = BoardKind::kChessboard;
  double mark_m = 0;  ///< side of a ChArUco tag with its black border, or diameter of a disc
  std::string family = "aruco-6x6-250";  ///< of ChArUco's tags

  int corners() const { return columns * rows; }
  bool circles() const {
    return kind == BoardKind::kCircles || kind == BoardKind::kAsymmetricCircles;
  }
  /// In steps of square_m, of point k, counted row by row. Asymmetric circles lie two steps apart
  /// along a row, odd rows one step to the right (as OpenCV numbers them).
  int StepsRight(int k) const {
    return kind == BoardKind::kAsymmetricCircles ? 2 * (k % columns) + k / columns % 2
                                                 : k % columns;
  }
  int StepsDown(int k) const { return k / columns; }
  /// Of point k [m], shape (2).
  Vec2 Corner(int k) const { return {square_m * StepsRight(k), square_m * StepsDown(k)}; }
  Vec2 Centre() const {
    const int right = kind == BoardKind::kAsymmetricCircles ? 2 * columns - 1 : columns - 1;
    return {0.5 * square_m * right, 0.5 * square_m * (rows - 1)};
  }
};

/// "chessboard", "charuco", "circles" and "acircles", as on the command line.
std::optional<BoardKind> BoardKindOfName(std::string_view name);
std::string_view NameOf(BoardKind kind);

/// A board by its kind and all its numbers, for a person.
std::string WordsOf(const Board& board);

/// A number that makes no board.
struct BoardFault {
  std::string_view key;  ///< "columns" (of both), "square_mm", "mark_mm" or "family"
  std::string words;     ///< what it must be
};
/// Nothing where the board is one.
std::optional<BoardFault> FaultOf(const Board& board);

/// The board's points as one frame shows them.
struct BoardView {
  std::string name;              ///< of the frame, for reasons
  double time_s = 0;             ///< monotonic, or the frame's number where there is no clock
  std::vector<Vec2> corners_px;  ///< row by row, Board::corners() of them
  std::vector<bool> seen;        ///< false: hidden or at the image's edge; its place means nothing
  double blur_px = 0;            ///< width of the edges, standard deviation
};

}  // namespace plumbline
