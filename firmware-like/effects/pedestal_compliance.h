// Pedestal compliance: a pedestal or floor that tilts under the arm.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Everything rotates about the base origin by value times the horizontal gravity moment there, of
/// links, tool body, mount and payload   [formats.md]. Unit: rad/(N m). Valid for a pedestal that
/// is equally soft in both directions; opening anchor bolts are not linear.
const Effect& PedestalCompliance();

}  // namespace plumbline::effects
