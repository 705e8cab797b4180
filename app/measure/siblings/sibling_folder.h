// Reader of a sibling's folder: the cell and the measured rows of another arm of the same model.
#pragma once

#include <string>

#include "app/base/config/fault.h"
#include "app/measure/siblings/arm_fit.h"

namespace plumbline::measure {

/// The two files of a sibling's folder.
std::string CellFileOf(const std::string& folder);
std::string RowsFileOf(const std::string& folder);
/// Reads both.
/// @param faults  receives warnings
/// @return        an error with the folder and the remedy
Result<Arm> ReadArm(const std::string& folder, config::FaultList& faults);

/// Why the second cell is not declared like the first: another number of joints, nominal kinematics
/// (a, d beyond 1 mm, angles beyond 0.1 degrees), declared compliances or link masses (1 %), or
/// effects of its own. Empty if it is declared alike.
std::string DifferenceOf(const model::CellModel& a, const model::CellModel& b);

}  // namespace plumbline::measure
