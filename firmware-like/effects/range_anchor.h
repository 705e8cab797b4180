// Range anchor error: an anchor of measured ranges that is not where it was declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Ranges are measured from anchor_mm + (x, y, z) in W:
///   range = (1 + measurement_scale) |p_WT - anchor - shift| + range_zero
/// File unit: mm. Changes the reading, not the arm; equivalent to a base that moved the opposite
/// way (base_frame). Needs [measurement] kind = "range".
const Effect& RangeAnchor();

}  // namespace plumbline::effects
