// An anchor of measured ranges that is not where it is declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// Ranges are measured from anchor_mm + (x, y, z) in W:
///   range = (1 + measurement_scale) |p_WT - anchor - shift| + range_zero
/// Unit of the files: mm. It changes what is read, not where the arm is; a base that moved the
/// other way (base_frame) reads the same. Needs [measurement] kind = "range".
const Effect& RangeAnchor();

}  // namespace plumbline
