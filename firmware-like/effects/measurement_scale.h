// Measurement scale: an instrument with a wrong scale.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The instrument reads (1 + scale) times the position   [formats.md]; for ranges, (1 + scale)
/// times the distance from the anchor (range_anchor.h). Unit: 1. The arm itself is not affected, so
/// a correction ignores this effect. From points alone it is indistinguishable from an arm whose
/// lengths all differ by the same ratio.
const Effect& MeasurementScale();

}  // namespace plumbline::effects
