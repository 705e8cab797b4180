// Payload mass: the payload weighs more or less than its recorded mass.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// m becomes m (1 + scale) + constant, in every row including those without payload   [formats.md].
/// Units: 1, kg. The scale represents a wrong unit or load cell, the constant a gripper or hose
/// that was not entered. The mass acts at the declared centre of gravity, on the joints and on the
/// tool.
const Effect& PayloadMass();

}  // namespace plumbline::effects
