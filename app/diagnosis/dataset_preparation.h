// Preparation of a data set from a table of measured rows.
#pragma once

#include "app/diagnosis/dataset.h"
#include "app/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline::diagnosis {

/// Checks the rows and prepares the data set.
/// @return  an error with advice if the rows cannot be used at all
Result<Dataset> DatasetFrom(const model::CellModel& cell, table::MeasuredTable measured);

}  // namespace plumbline::diagnosis
