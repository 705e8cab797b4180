// Notes on what the rows and the cell do not state, and what cannot be identified without it.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Fills `not_recorded`, and adds notes. Everything else of the data set must be set.
void NoteMissingSignals(Dataset& data);

}  // namespace plumbline::measure
