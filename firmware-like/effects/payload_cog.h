// Payload centre of gravity: a load whose centre of gravity is not where it was declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The payload's centre of gravity moves by (x, y, z) in F   [formats.md]. File unit: mm. Has no
/// effect without a payload.
const Effect& PayloadCog();

}  // namespace plumbline::effects
