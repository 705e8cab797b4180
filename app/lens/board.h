// The flat target that a lens is calibrated with.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// A chessboard, named by its inner corners: 18 x 12 squares have 17 x 11 of them.
/// Frame K: origin at the first corner, x along a row of corners, y down the rows, z into the
/// board; the camera looks along +z when the board is upright in front of it.
struct Board {
  int columns = 17, rows = 11;  ///< inner corners
  double square_m = 0.010;

  int corners() const { return columns * rows; }
  /// Of corner k, counted row by row [m], shape (2).
  Vec2 Corner(int k) const {
    const int row = k / columns;
    return {square_m * (k % columns), square_m * row};
  }
  Vec2 Centre() const { return {0.5 * square_m * (columns - 1), 0.5 * square_m * (rows - 1)}; }
};

/// The board's corners as one frame shows them.
struct BoardView {
  std::string name;              ///< of the frame, for reasons
  double time_s = 0;             ///< monotonic, or the frame's number where there is no clock
  std::vector<Vec2> corners_px;  ///< row by row, Board::corners() of them
  std::vector<bool> seen;        ///< false: hidden or at the image's edge; its place means nothing
  double blur_px = 0;            ///< width of the edges, standard deviation
};

}  // namespace plumbline
