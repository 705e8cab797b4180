// Calibration board: the flat target that a lens is calibrated with.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::target {

/// Pattern printed on the board, with the points that are detected.
enum class BoardKind {
  kChessboard,  ///< the inner corners: 18 x 12 squares have 17 x 11 of them
  kCharuco,     ///< as for a chessboard; each white square also carries a tag that identifies it
  kCircles,     ///< the centres of dark discs on a rectangular grid
  kAsymmetricCircles,  ///< as for kCircles, with every other row shifted by half a step
};

/// Geometry of a board.
/// Frame K: origin at the first point, x along a row, y down the rows, z into the board; a camera
/// in front of the upright board looks along +z. A ChArUco board is upright when its tags are.
struct Board {
  int columns = 17, rows = 11;  ///< number of points
  double square_m = 0.010;      ///< side of a square; for circles, distance between rows
  BoardKind kind = BoardKind::kChessboard;
  double marker_m = 0;  ///< side of a ChArUco tag including its black border, or diameter of a disc
  std::string family = "aruco-6x6-250";  ///< of the ChArUco tags

  int corners() const { return columns * rows; }
  bool circles() const {
    return kind == BoardKind::kCircles || kind == BoardKind::kAsymmetricCircles;
  }
  /// Column and row of point k in units of square_m; points are numbered row by row. On an
  /// asymmetric grid the points of a row are two steps apart, and odd rows are shifted one step to
  /// the right (OpenCV's numbering).
  int StepsRight(int k) const {
    return kind == BoardKind::kAsymmetricCircles ? 2 * (k % columns) + k / columns % 2
                                                 : k % columns;
  }
  int StepsDown(int k) const { return k / columns; }
  /// Position of point k in the board plane [m], shape (2).
  lens::Vec2 Corner(int k) const { return {square_m * StepsRight(k), square_m * StepsDown(k)}; }
  lens::Vec2 Centre() const {
    const int right = kind == BoardKind::kAsymmetricCircles ? 2 * columns - 1 : columns - 1;
    return {0.5 * square_m * right, 0.5 * square_m * (rows - 1)};
  }
};

/// A turn of a board about its centre that leaves its points in the same places.
struct BoardTurn {
  int quarters = 0;  ///< quarter turns from x to y, 0..3
  /// The point that takes the place of each point: R p_k + (1 - R) centre.
  std::vector<int> points;
};
/// All turns of a board, the identity first: the points do not show by which of them it is turned.
/// Two for most rectangles, four for squares, one if tags, shifted rows or the colours of a
/// chessboard reveal the order of the points: half a turn swaps the colours of 9 x 6 inner corners.
std::vector<BoardTurn> SymmetriesOf(const Board& board);

/// White square inside the top left square of a chessboard: `plumbline print board` prints it, so
/// that images show the order of the points.
struct BoardMark {
  lens::Vec2 centre;  ///< in the board plane [m]
  double size_m;      ///< side
};
/// @return  nullopt for other boards
std::optional<BoardMark> MarkOf(const Board& board);

/// "chessboard", "charuco", "circles" or "acircles", as on the command line.
std::optional<BoardKind> BoardKindOfName(std::string_view name);
std::string_view NameOf(BoardKind kind);

/// Readable description: kind and all dimensions.
std::string WordsOf(const Board& board);

/// An invalid dimension of a board.
struct BoardFault {
  std::string_view key;  ///< "columns" (for both counts), "square_mm", "mark_mm" or "family"
  std::string message;   ///< the requirement
};
/// @return  nullopt if the board is valid
std::optional<BoardFault> FaultOf(const Board& board);

}  // namespace plumbline::target
