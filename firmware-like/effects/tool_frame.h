// A tip that sits elsewhere on the flange than declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The tip moves by (x, y, z) in F, beside what bends. A nuisance where the cell calls the tool
/// unknown, an effect where it calls it known. Unit of the files: mm. Only the tip moves; masses
/// and the tool's bending stay as declared.
const Effect& ToolFrame();

}  // namespace plumbline
