// A load that weighs more, or less, than it is said to.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// m becomes m (1 + scale) + constant, in every row, empty ones too   [formats.md]. Units: 1, kg.
/// The scale is a wrong unit or cell, the constant a gripper or a hose that nobody entered. The
/// mass acts at the declared centre of gravity, on the joints and on the tool alike.
const Effect& PayloadMass();

}  // namespace plumbline
