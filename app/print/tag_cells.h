// The black cells of a tag on a sheet.
#pragma once

#include "app/print/sheet.h"
#include "app/tracking/tag_family.h"

namespace plumbline::print {

/// Adds the black cells of an upright tag, as the detector reads them: for 36h11 this is the
/// AprilTag library's orientation. The white border is the caller's.
/// @param middle   of the tag [mm]
/// @param side_mm  side of the black square
void AddTagCells(Sheet& sheet, const tracking::TagFamily& family, int id, const Vec2& middle,
                 double side_mm);

}  // namespace plumbline::print
