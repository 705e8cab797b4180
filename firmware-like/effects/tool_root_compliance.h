// Tool root compliance: a flange coupling that tilts under the tool's moment.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The coupling rotates by value times the transverse moment about the root: that of the payload at
/// its centre of gravity plus that of the tool body at mid length (without the mount). The tip
/// moves by that rotation x (0, 0, L) [formats.md]. Unit: rad/(N m). Valid as long as the faces of
/// the coupling stay in contact.
const Effect& ToolRootCompliance();

}  // namespace plumbline::effects
