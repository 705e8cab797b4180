// Outlines of the black cells of a grid.
#pragma once

#include <vector>

#include "app/vision/print/sheet.h"

namespace plumbline::vision {

/// Boundary of the black cells, to be filled by the even-odd rule. Adjacent cells share no edge:
/// filled one by one, they would be separated by hairlines in most viewers.
/// @param black    cells row by row from the top left; a whole number of rows
/// @param columns  cells in a row
/// @param corner   top left corner of the grid [mm]
/// @param side     side of a cell [mm]
std::vector<Outline> CellOutlines(const std::vector<bool>& black, int columns, const Vec2& corner,
                                  double side);

}  // namespace plumbline::vision
