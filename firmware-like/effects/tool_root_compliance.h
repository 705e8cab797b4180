// A flange coupling that tilts under the tool's moment.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The coupling turns by value times the transverse moment at the root, of the payload at its
/// centre of gravity and of the tool body at mid length (without the mount); the tip moves by that
/// rotation x (0, 0, L)   [formats.md]. Unit: rad/(N m). Valid while the seat does not open.
const Effect& ToolRootCompliance();

}  // namespace plumbline
