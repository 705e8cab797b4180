// The black cells of a tag on a sheet.
#pragma once

#include "app/base/target/tag_family.h"
#include "app/vision/print/sheet.h"

namespace plumbline::vision {

/// Adds the black cells of an upright tag, as the detector reads them: for 36h11 this is the
/// AprilTag library's orientation. The white border is the caller's.
/// @param middle   of the tag [mm]
/// @param side_mm  side of the black square
void AddTagCells(Sheet& sheet, const target::TagFamily& family, int id, const Vec2& middle,
                 double side_mm);

}  // namespace plumbline::vision
