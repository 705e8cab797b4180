// Ranges counted from another place than the instrument's zero.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// A measured range is longer by the value: where a wire leaves its drum, or the offset of a
/// distance meter's prism. Unit of the files: mm. It changes what is read, not where the arm is.
/// Needs [measurement] kind = "range".
const Effect& RangeZero();

}  // namespace plumbline
