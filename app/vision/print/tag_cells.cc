#include "app/vision/print/tag_cells.h"

#include <map>
#include <utility>

namespace plumbline::vision {
namespace {

using GridPoint = std::pair<int, int>;  // column and row of a cell corner

/// Unit edges between a black and a white cell, with black on the right of the direction.
std::multimap<GridPoint, GridPoint> BoundaryEdges(const std::vector<bool>& black, int columns) {
  const int rows = static_cast<int>(black.size()) / columns;
  const auto is_black = [&](int column, int row) {
    return column >= 0 && row >= 0 && column < columns && row < rows &&
           black[row * columns + column];
  };
  std::multimap<GridPoint, GridPoint> edges;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (!is_black(column, row)) continue;
      const GridPoint top_left(column, row), top_right(column + 1, row),
          bottom_right(column + 1, row + 1), bottom_left(column, row + 1);
      if (!is_black(column, row - 1)) edges.emplace(top_left, top_right);
      if (!is_black(column + 1, row)) edges.emplace(top_right, bottom_right);
      if (!is_black(column, row + 1)) edges.emplace(bottom_right, bottom_left);
      if (!is_black(column - 1, row)) edges.emplace(bottom_left, top_left);
    }
  }
  return edges;
}

bool Collinear(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
  return (a.first == b.first && b.first == c.first) ||
         (a.second == b.second && b.second == c.second);
}

}  // namespace

std::vector<Outline> CellOutlines(const std::vector<bool>& black, int columns, const Vec2& corner,
                                  double side) {
  auto edges = BoundaryEdges(black, columns);
  std::vector<Outline> outlines;
  while (!edges.empty()) {
    // As many edges leave a point as reach it, so every chain of edges closes.
    std::vector<GridPoint> chain{edges.begin()->first};
    do {
      const auto next = edges.find(chain.back());
      chain.push_back(next->second);
      edges.erase(next);
    } while (chain.back() != chain.front());
    chain.pop_back();
    Outline outline;
    const std::size_t count = chain.size();
    for (std::size_t k = 0; k < count; ++k) {
      const GridPoint& at = chain[k];
      if (Collinear(chain[(k + count - 1) % count], at, chain[(k + 1) % count])) continue;
      outline.emplace_back(corner + side * Vec2(at.first, at.second));
    }
    outlines.push_back(std::move(outline));
  }
  return outlines;
}

void AddTagCells(Sheet& sheet, const target::TagFamily& family, int id, const Vec2& middle,
                 double side_mm) {
  const int n = family.data_cells, cells = family.cells();
  std::vector<bool> black(static_cast<std::size_t>(cells * cells), true);
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const int bit = n * n - 1 - (row * n + column);
      black[(row + 1) * cells + column + 1] = ((family.codes[id] >> bit) & 1) == 0;
    }
  }
  for (Outline& outline :
       CellOutlines(black, cells, middle - Vec2::Constant(0.5 * side_mm), side_mm / cells)) {
    sheet.outlines.push_back(std::move(outline));
  }
}

}  // namespace plumbline::vision
