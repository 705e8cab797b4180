// Joints that a file counts from 0 to 360 degrees, within the limits of a cell.
#pragma once

#include "app/measure/imports/import_table.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Subtracts 360 degrees from the values of a joint that lie above the limits of the cell, if the
/// file counts that joint from 0 to 360 (all of its values lie there), its range is one turn at
/// most, a whole turn leads to the same posture (kinematics::Chain::RepeatsAfterTurn), and all its
/// values are then within the limits by `margin_rad`. Other values stay as they
/// are, for the check of the limits. Adds a note for each joint that is changed.
void SubtractWholeTurns(const model::Robot& robot, double margin_rad, ImportedTable& table);

}  // namespace plumbline::measure
