// Every candidate effect and what became of it.
#pragma once

#include "app/diagnosis/findings.h"

namespace plumbline {

/// Adds every effect of the catalogue with what it explains alone and why it was taken or not; the
/// rivals must have been added before.
void AddConsidered(const FindingsContext& context, const Candidates& candidates,
                   Diagnosis& diagnosis);

}  // namespace plumbline
