// Range zero error: ranges with a constant offset.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// A measured range is too long by the value, because of the point where the wire leaves its drum,
/// or the prism offset of a distance meter. File unit: mm. Changes the reading, not the arm. Needs
/// [measurement] kind = "range".
const Effect& RangeZero();

}  // namespace plumbline::effects
