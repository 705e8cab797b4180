#include "app/vision/print/tag_cells.h"

#include <utility>

#include "app/vision/print/cell_outlines.h"

namespace plumbline::vision {

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
