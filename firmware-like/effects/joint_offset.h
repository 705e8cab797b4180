// Joint offset: a joint whose zero is not where the controller assumes.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i += value_i, the same in every posture   [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. Unit: rad; m for a prismatic joint. The first joint's offset acts like a
/// rotation of the base, the last one's like a rotation of the tool; neither is identifiable if
/// that frame is estimated too.
const Effect& JointOffset();

}  // namespace plumbline::effects
