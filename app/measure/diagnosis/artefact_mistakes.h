// Mistakes in rows on artefacts.
#pragma once

#include <vector>

#include "app/measure/diagnosis/mistakes.h"

namespace plumbline::measure {

/// Adds gauges that read with the opposite sign, and pairs of artefacts of one kind whose declared
/// positions are swapped (of at most 12 artefacts).
void AddArtefactMistakes(const Dataset& data, std::vector<Mistake>& mistakes);

}  // namespace plumbline::measure
