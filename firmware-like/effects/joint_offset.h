// A joint whose zero is not where the controller thinks.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i += value_i, the same in every posture   [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. Unit: rad ([m] for a prismatic joint). The first joint's offset is a turn
/// of the base, the last one's of the tool; neither shows where that frame is estimated.
const Effect& JointOffset();

}  // namespace plumbline
