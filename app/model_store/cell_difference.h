// What two cells differ in, by the keys of cell.toml.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Every value in which two models of a cell differ, in the keys and units of cell.toml, those that
/// are new last: "robot.joint[2].compliance_rad_per_Nm 1e-06 -> 2e-06", "domain.payload_kg absent
/// -> [0, 60]". Empty where both are the same model, however their files are written: comments,
/// order of keys, spelling of numbers and defaults written out do not count, nor do the robot's
/// name and where an effect came from.
std::vector<std::string> CellDifferences(const CellModel& before, const CellModel& after);

/// The same of two texts. Texts that are the same byte by byte do not differ; of others that are no
/// cell (of this version) the answer is one line that says so: they cannot be taken for the same.
std::vector<std::string> CellTextDifferences(const std::string& before, const std::string& after);

}  // namespace plumbline
