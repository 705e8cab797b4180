// What to do about a point without a correction.
#pragma once

#include "firmware-like/correction/correct.h"

namespace plumbline::correction {

/// Short instruction that names what to check; "" for kOk. The manual's table of result codes says
/// more.
const char* RemedyOf(CorrectionCode code);

}  // namespace plumbline::correction
