// Tool stiffness: a tool that bends less or more than its section predicts.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// E I of the tool is multiplied by 1 + ratio   [formats.md]; the bending of the declared beam is
/// divided by it. Unit: 1; must be above -1. A joined or perforated tool may well have half its
/// nominal stiffness.
const Effect& ToolStiffness();

}  // namespace plumbline::effects
