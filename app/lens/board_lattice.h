// Saddle points that hang together as the corners of one board.
#pragma once

#include <vector>

#include "app/lens/saddle_points.h"

namespace plumbline {

/// A connected piece of a chessboard: places of its corners, row by row.
struct Lattice {
  int columns = 0, rows = 0;
  std::vector<int> points;  ///< index into the saddle points, or -1 where there is none

  int At(int column, int row) const {
    return points[static_cast<std::size_t>(row) * columns + column];
  }
  int found() const;
};

/// Links neighbours along their edges and numbers each connected piece, largest first. Two points
/// are neighbours where each is the nearest along an edge of the other and their colours alternate.
/// Rows run to the right and downwards as far as the board's turn allows; x cross y points away
/// from the viewer, so that a lattice is never mirrored.
std::vector<Lattice> FindLattices(const std::vector<SaddlePoint>& points);

}  // namespace plumbline
