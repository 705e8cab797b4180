// Table of all candidate effects and why each was selected or rejected.
#pragma once

#include "app/measure/diagnosis/findings.h"

namespace plumbline::measure {

/// Adds to `diagnosis.considered` every effect of the catalogue with the share that it explains
/// alone and the reason why it was selected or rejected. Requires `diagnosis.rivals`.
void AddCandidateOutcomes(const FindingsContext& context, const Candidates& candidates,
                          Diagnosis& diagnosis);

}  // namespace plumbline::measure
