// Spatial index of points in an image, for neighbour queries.
#pragma once

#include <initializer_list>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// Points in a grid of square cells.
class PointGrid {
 public:
  /// @param size  of a cell [px]
  PointGrid(std::vector<lens::Vec2> points, double size);

  /// Up to `count` other points, nearest first.
  /// @param reaches  the search extends over so many cells in each direction, from the first number
  ///                 on, until it finds `count` points
  std::vector<int> Nearest(int of, std::size_t count, std::initializer_list<int> reaches) const;

  /// The point nearest to a position, or -1.
  int At(const lens::Vec2& position, double within) const;

 private:
  int CellOf(double at, int count) const;
  /// Calls `each` for the points of all cells that a square touches; some are outside the square.
  template <typename Each>
  void Around(const lens::Vec2& at, double reach, const Each& each) const;

  const std::vector<lens::Vec2> points_;
  const double size_;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<int>> cells_;
};

}  // namespace plumbline::vision
