// Pedestal compliance: a pedestal or floor that tilts under the arm.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The whole arm rotates about the base origin by value times the horizontal gravity moment of
/// links, tool body, mount and payload about that origin   [formats.md]. Unit: rad/(N m). Valid for
/// a pedestal that is equally soft in both directions; an anchorage that lifts off is nonlinear and
/// not modelled.
const Effect& PedestalCompliance();

}  // namespace plumbline::effects
