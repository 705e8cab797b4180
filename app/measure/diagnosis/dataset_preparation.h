// Preparation of a data set from a table of measured rows.
#pragma once

#include "app/measure/diagnosis/dataset.h"
#include "app/measure/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

/// Checks the rows and prepares the data set.
/// @return  an error with advice if the rows cannot be used at all
Result<Dataset> DatasetFrom(const model::CellModel& cell, MeasuredTable measured);

}  // namespace plumbline::measure
