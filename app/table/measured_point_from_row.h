// Conversion of table rows to measured points.
#pragma once

#include "app/table/csv.h"
#include "firmware-like/model/measured_point.h"

namespace plumbline::table {

/// Values that the table did not record or the row lacks are absent.
/// @param recorded  columns of the row's table
model::MeasuredPoint MeasuredPointFromRow(const MeasuredRow& row, const RecordedColumns& recorded);

}  // namespace plumbline::table
