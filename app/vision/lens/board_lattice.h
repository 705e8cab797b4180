// Grouping of saddle points into chessboard lattices.
#pragma once

#include <vector>

#include "app/vision/lens/saddle_points.h"

namespace plumbline::vision {

/// A connected piece of a chessboard.
struct Lattice {
  int columns = 0, rows = 0;
  std::vector<int> points;  ///< row by row: index of the saddle point, or -1 if there is none

  int At(int column, int row) const {
    return points[static_cast<std::size_t>(row) * columns + column];
  }
  int found() const;
};

/// Links neighbouring points along their edges and numbers each connected piece; largest first. Two
/// points are neighbours if each is the nearest along an edge of the other and their colours
/// alternate. Columns count to the right and rows down as far as the board's rotation allows; x
/// cross y points away from the viewer, so a lattice is never mirrored.
std::vector<Lattice> FindLattices(const std::vector<SaddlePoint>& points);

}  // namespace plumbline::vision
