// Check of imported joint readings against the joint limits of a cell.
#pragma once

#include <string>

#include "app/base/config/fault.h"
#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cli {

/// Adds a fault for the first joint of which a row is outside the limits by more than 0.02 rad or
/// 20 mm, the margin of the daemon's plausibility filter. Rows without a measurement count too.
/// @param angle_unit  that the user stated for columns without a unit; empty if none
void CheckImportedJoints(const model::CellModel& cell, const measure::MeasuredTable& table,
                         const std::string& angle_unit, config::FaultList& faults);

}  // namespace plumbline::cli
