// The black cells of a tag on a sheet.
#pragma once

#include <vector>

#include "app/base/target/tag_family.h"
#include "app/vision/print/sheet.h"

namespace plumbline::vision {

// Outlines of the black cells of a grid.

/// Boundary of the black cells, to be filled by the even-odd rule. Adjacent cells share no edge:
/// filled one by one, they would be separated by hairlines in most viewers.
/// @param black    cells row by row from the top left; a whole number of rows
/// @param columns  cells in a row
/// @param corner   top left corner of the grid [mm]
/// @param side     side of a cell [mm]
std::vector<Outline> CellOutlines(const std::vector<bool>& black, int columns, const Vec2& corner,
                                  double side);

/// Adds the black cells of an upright tag, as the detector reads them: for 36h11 this is the
/// AprilTag library's orientation. The white border is the caller's.
/// @param middle   of the tag [mm]
/// @param side_mm  side of the black square
void AddTagCells(Sheet& sheet, const target::TagFamily& family, int id, const Vec2& middle,
                 double side_mm);

}  // namespace plumbline::vision
