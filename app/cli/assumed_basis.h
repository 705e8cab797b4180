// Explanation of radii with the basis "assumed".
#pragma once

#include <string>

#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cli {

/// Lists what the cell and the poses do not declare, and the remedy. If all of it is declared,
/// lists what the radii rest on instead: see deflection/assumed_error.h.
/// @param deviation_stated  the user stated the deviation of the declared deflections
std::string AssumedBasisText(const model::CellModel& cell, const measure::MeasuredTable& poses,
                             bool deviation_stated);

}  // namespace plumbline::cli
