// A load whose weight pulls elsewhere than declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The payload's centre of gravity moves by (x, y, z) in F   [formats.md]. Unit of the files: mm.
/// Needs a payload; without one nothing moves.
const Effect& PayloadCog();

}  // namespace plumbline
