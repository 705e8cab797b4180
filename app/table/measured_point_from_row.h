// A row of a table as a measured point.
#pragma once

#include "app/table/csv.h"
#include "firmware-like/model/measured_point.h"

namespace plumbline {

/// What the table did not record, or the row lacks, is absent.
/// @param row  of that table
MeasuredPoint MeasuredPointFromRow(const MeasuredRow& row, const RecordedColumns& recorded);

}  // namespace plumbline
