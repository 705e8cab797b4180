// What to do about a point without a correction.
#pragma once

#include "firmware-like/correction/correct.h"

namespace plumbline::correction {

/// Short instruction that names what to check; "" for kOk. The table of result codes in
/// docs/program.md says more.
const char* RemedyOf(CorrectionCode code);

}  // namespace plumbline::correction
