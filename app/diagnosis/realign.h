// A cell's frames for a new session.
#pragma once

#include "app/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline {

/// The cell with the frames that its [measurement] leaves free (instrument's pose, tip) estimated
/// anew from these rows, one [[session]] each; its effects act and stay as they are. The cell
/// itself where it leaves nothing free.
/// @return  an error where the rows cannot hold the frames
Result<CellModel> Realigned(const CellModel& cell, const MeasuredTable& measured, int threads);

}  // namespace plumbline
