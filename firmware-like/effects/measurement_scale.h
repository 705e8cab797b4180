// An instrument whose metre is not a metre.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The instrument reads (1 + scale) times the position   [formats.md]; of ranges, (1 + scale) times
/// the distance from the anchor (range_anchor.h). Unit: 1. The arm itself is right: for a
/// correction this is nothing to correct. From points alone it cannot be told from an arm whose
/// lengths all differ by the same ratio.
const Effect& MeasurementScale();

}  // namespace plumbline
