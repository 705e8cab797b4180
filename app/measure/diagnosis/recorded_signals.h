// Signals that vary over the rows of a data set, and joints that do not.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Finds the signals that effects may depend on: time, row number, temperature, payload, further
/// columns and the joints' quantities. Call it after the conditions of the rows are set.
void FindSignals(Dataset& data);

/// Finds the joints that never moved, with a note for each.
void FindStillJoints(Dataset& data);

}  // namespace plumbline::measure
