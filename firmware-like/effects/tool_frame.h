// Tool frame error: a tip that is not where it was declared on the flange.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The tip moves by (x, y, z) in F, in addition to the bending. It is a nuisance parameter if the
/// cell declares the tool as unknown, and an effect if known. File unit: mm. Only the tip moves;
/// masses and the bending of the tool stay as declared.
const Effect& ToolFrame();

}  // namespace plumbline::effects
